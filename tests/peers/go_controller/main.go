// A ring controller in Go, written from docs/drivers.md and drivers/profiles/ring.toml alone.
//
// It prints "ready PORT" when it can be reached, and ends when its standard input does, or by SIGTERM. SIGUSR1 boots it anew.
package main

import (
	"bufio"
	"flag"
	"fmt"
	"io"
	"net"
	"os"
	"os/signal"
	"strconv"
	"syscall"
	"time"
)

type options struct {
	port, baud, unit, ring, lateEvery, cutEvery, missEvery    int
	pty, truth, log                                           string
	rate, ppm, delayMS, jitterMS, scanMS, lateMS, bootS       float64
	replyAtEdge, noFC23, missLeavesHole, lean, watchdogAlways bool
	serial, seed                                              int64
	tickStart                                                 uint32
	sequenceStart                                             uint64
}

var began = time.Now()

func itoa(n int) string { return strconv.Itoa(n) }

func parse() (*options, bool) {
	o := &options{}
	flag.IntVar(&o.port, "port", 0, "Modbus TCP; 0: any free one")
	flag.StringVar(&o.pty, "pty", "", "RTU on a pseudo-terminal that is linked here")
	flag.IntVar(&o.baud, "baud", 115200, "")
	flag.IntVar(&o.unit, "unit", 1, "")
	flag.Float64Var(&o.rate, "rate-hz", 1000, "samples a second of device time")
	flag.Float64Var(&o.ppm, "ppm", 0, "the device's clock runs so much fast")
	tick := flag.Uint64("tick-start-us", 0, "")
	flag.Uint64Var(&o.sequenceStart, "sequence-start", 0, "number of the first sample")
	flag.Float64Var(&o.delayMS, "delay-ms", 0, "each reply is held so long")
	flag.Float64Var(&o.jitterMS, "jitter-ms", 0, "and up to so much longer")
	flag.Float64Var(&o.scanMS, "scan-ms", 0, "publishes and takes commands only so often")
	flag.BoolVar(&o.replyAtEdge, "reply-at-edge", false, "answers, too, at the edge of a scan only")
	flag.BoolVar(&o.noFC23, "no-fc23", false, "")
	flag.IntVar(&o.missEvery, "miss-every", 0, "a control cycle is missed after so many samples")
	flag.BoolVar(&o.missLeavesHole, "miss-leaves-hole", false, "its number is missing, too")
	flag.IntVar(&o.ring, "ring", 65536, "samples held")
	flag.IntVar(&o.lateEvery, "late-every", 0, "")
	flag.Float64Var(&o.lateMS, "late-ms", 1000, "")
	flag.IntVar(&o.cutEvery, "cut-every", 0, "")
	flag.Float64Var(&o.bootS, "boot-s", 1, "")
	flag.Int64Var(&o.serial, "serial", 9001, "")
	flag.Int64Var(&o.seed, "seed", 1, "")
	flag.StringVar(&o.truth, "truth", "", "")
	flag.StringVar(&o.log, "log", "", "")
	flag.BoolVar(&o.lean, "lean", false, "a map without all that may be left out")
	flag.BoolVar(&o.watchdogAlways, "watchdog-always", false, "the watchdog runs out with the valve off, too")
	show := flag.Bool("print-profile", false, "print the register profile and end")
	flag.Parse()
	o.tickStart = uint32(*tick)
	return o, *show
}

// control makes the samples that are due by the device's own clock.
func control(d *device, stop chan struct{}) {
	period, rate := 1/d.o.rate, 1+d.o.ppm*1e-6
	start, boot := time.Now(), d.boot
	sinceMiss, scans := 0, 0
	for {
		select {
		case <-stop:
			return
		default:
		}
		d.Lock()
		if d.boot != boot {
			start, boot, sinceMiss, scans = time.Now(), d.boot, 0, 0
		}
		due := time.Since(start).Seconds() * rate
		for i := 0; i < 50 && d.clock+period <= due; i++ {
			if d.down {
				d.plant.advance(d.command, period)
				d.clock += period
				continue
			}
			dt := period
			if sinceMiss++; d.o.missEvery > 0 && sinceMiss >= d.o.missEvery {
				dt, sinceMiss = 2*period, 0
				d.missed++
				if d.o.missLeavesHole {
					d.sequence++
				}
			}
			d.cycle(dt)
			d.take()
			if n := int(d.clock * 1000 / max(d.o.scanMS, 1e-9)); d.o.scanMS <= 0 || n != scans {
				scans = n
				d.scan()
			}
			if d.truth != nil && d.produced%200 == 0 {
				d.truth.Flush()
			}
		}
		wait := time.Duration((d.clock + period - due) / rate * 1e9)
		d.Unlock()
		time.Sleep(wait)
	}
}

func (s *server) boot() {
	d := s.d
	d.Lock()
	d.down = true
	d.say("down", nil)
	d.plant.openValve(false)
	d.Unlock()
	if s.listener != nil {
		s.close()
	}
	time.Sleep(time.Duration(d.o.bootS * 1e9))
	d.Lock()
	d.boot++
	d.start()
	d.down = false
	d.say("boot", map[string]any{"number": d.boot})
	d.Unlock()
	if s.listener != nil {
		if _, err := s.listen(s.d.o.port); err != nil {
			fmt.Fprintln(os.Stderr, err)
			os.Exit(1)
		}
	}
}

func main() {
	o, show := parse()
	if show {
		fmt.Print(newLayout(o.lean).profile())
		return
	}
	d := &device{o: o, l: newLayout(o.lean), plant: newPlant(o.seed), edge: make(chan struct{})}
	fail := func(err error) {
		if err != nil {
			fmt.Fprintln(os.Stderr, "controller:", err)
			os.Exit(1)
		}
	}
	var err error
	if o.truth != "" {
		d.truthOn, err = os.Create(o.truth)
		fail(err)
		d.truth = bufio.NewWriter(d.truthOn)
	}
	if o.log != "" {
		d.journal, err = os.Create(o.log)
		fail(err)
	}
	d.start()
	s := &server{d: d, clients: map[net.Conn]bool{}}
	port := 0
	if o.pty != "" {
		fail(s.openTerminal(o.pty))
		go s.rtu()
	} else {
		port, err = s.listen(o.port)
		fail(err)
		o.port = port
	}
	stop := make(chan struct{})
	go control(d, stop)
	fmt.Printf("ready %d\n", port)
	signals := make(chan os.Signal, 4)
	signal.Notify(signals, syscall.SIGTERM, syscall.SIGINT, syscall.SIGUSR1)
	go func() {
		io.Copy(io.Discard, os.Stdin) // who started it holds the other end
		signals <- syscall.SIGTERM
	}()
	for number := range signals {
		if number != syscall.SIGUSR1 {
			break
		}
		s.boot()
	}
	close(stop)
	d.Lock()
	if d.truth != nil {
		d.truth.Flush()
	}
	if o.pty != "" {
		os.Remove(o.pty)
	}
	d.say("bye", map[string]any{"produced": d.produced, "missed": d.missed, "position_mm": d.plant.position,
		"valve": d.plant.valveOpen})
}
