package main

// The device: control cycle, CiA 402, commands, watchdog, writer's lock, ring, truth.

import (
	"bufio"
	"encoding/binary"
	"encoding/json"
	"hash/crc32"
	"math"
	"os"
	"sync"
	"time"
)

const (
	off       = 0x40
	ready     = 0x21
	switched  = 0x23
	enabled   = 0x27
	reacting  = 0x0F
	faulted   = 0x08
	ratedKN   = 650.0
	ratedMM   = 250.0
	ratedMMPS = 800.0
)

type sample struct {
	sequence uint64
	values   [8]uint16 // as on the wire
}

type pending struct {
	what  string // "block", "execute", "control"
	word  uint16
	order order
}

type truthRow struct {
	Sequence, Tick                      uint32
	Force                               int32
	Stroke1, Stroke2, Position, Command int16
	TrueForce, TrueStroke               float32
	State, StatusWord, Boot, Missed     uint16
}

type device struct {
	sync.Mutex
	o       *options
	l       *layout
	plant   *plant
	image   [imageSize]uint16 // what was written, and what was published last
	edge    chan struct{}     // closed at the next edge of the scan, then a new one
	pending []pending

	drive, control, fault             uint16
	moving, good, executed            bool
	armed, running                    order
	move                              motion
	echo, reject, done, reason, trips uint16
	cycles                            uint32
	command, commandSpeed             float64
	clock, fed, writerSeen            float64
	sequence                          uint64
	ring                              []sample
	made, published, produced, missed uint64
	overruns, boot                    uint16
	down                              bool

	truth   *bufio.Writer
	truthOn *os.File
	journal *os.File
}

func (d *device) say(event string, facts map[string]any) {
	if d.journal == nil {
		return
	}
	if facts == nil {
		facts = map[string]any{}
	}
	facts["event"], facts["clock_s"], facts["force_kN"] = event, d.clock, d.plant.force
	facts["monotonic_s"] = time.Since(began).Seconds()
	line, _ := json.Marshal(facts)
	d.journal.Write(append(line, '\n'))
}

func (d *device) start() {
	d.image = [imageSize]uint16{}
	d.pending = nil
	d.drive, d.control, d.fault = off, 0, 0
	d.moving, d.good, d.executed = false, false, false
	d.armed, d.running = order{}, order{}
	d.echo, d.reject, d.done, d.reason, d.trips, d.cycles = 0, 0, 0, 0, 0, 0
	d.clock, d.fed, d.writerSeen = 0, 0, 0
	d.command = d.plant.position
	d.sequence, d.made, d.published, d.overruns = d.o.sequenceStart, 0, 0, 0
	d.ring = make([]sample, d.o.ring)
	d.l.put(d.image[:], "device_type", 0x60C1)
	d.l.put(d.image[:], "profile_version", 9)
	d.l.put(d.image[:], "test_float", -1234.5)
	d.l.put(d.image[:], "test_integer", 0x12345678)
	d.l.put(d.image[:], "serial", float64(d.o.serial))
	d.l.put(d.image[:], "sample_rate", d.o.rate)
	d.l.put(d.image[:], "force_limit", ratedKN)
	d.l.put(d.image[:], "stroke_limit", ratedMM)
	d.publish()
}

func (d *device) on() bool { return d.drive == enabled || d.drive == reacting }

func (d *device) endMotion(reason int) {
	if d.moving && d.running.sequence != 0 {
		d.done, d.reason = d.running.sequence, uint16(reason)
		d.say("end", map[string]any{"sequence": d.done, "reason": reason})
	}
	d.moving = false
}

func (d *device) valve(open bool) {
	if d.plant.valveOpen == open {
		return
	}
	d.plant.openValve(open)
	d.command, d.commandSpeed = d.plant.position, 0
	if open {
		d.say("valve-on", nil)
	} else {
		d.say("valve-off", nil)
	}
}

func (d *device) giveUp(fault uint16, reason int) {
	d.say("fault", map[string]any{"code": fault})
	d.fault = fault
	if fault == 1 {
		d.trips++
	}
	d.endMotion(reason)
	if d.plant.valveOpen {
		d.drive = reacting
		d.running = order{code: codeRelease, speed: 20}
		d.move, d.moving = d.begin(d.running), true
	} else {
		d.drive = faulted
	}
}

// ---- commands

func within(v, low, high float64) bool { return v >= low && v <= high } // false for what is no number

func (d *device) judge(o order) uint16 {
	reach, force := d.l.get(d.image[:], "stroke_limit"), d.l.get(d.image[:], "force_limit")
	if o.code < codeHold || o.code > codeRelease {
		return 1
	}
	if d.drive != enabled || (d.moving && o.code != codeHold && o.code != codeRelease) {
		return 2
	}
	good, place := true, true
	switch o.code {
	case codeRamp:
		good = within(o.target, -20, reach) && within(o.speed, 0.001, ratedMMPS)
	case codeHarmonic:
		peak := 2 * math.Pi * o.frequency * o.amplitude
		good = within(o.mean+o.amplitude, 0, reach) && within(o.mean-o.amplitude, -0.5, reach) && o.amplitude > 0 &&
			within(o.frequency, 0.0001, 5) && o.cycles > 0 && peak <= ratedMMPS
		place = math.Abs(d.command-o.mean) <= 0.5
	case codeStatic:
		good = within(o.speed, 0.001, ratedMMPS) && within(o.turningForce, 0.05, force) &&
			within(o.turningStroke, 0.1, reach) && o.cycles > 0
		place = math.Abs(d.command) <= 1
	case codeRelease:
		good = within(o.speed, 0.001, ratedMMPS)
	}
	if !good {
		return 3
	}
	if !place {
		return 2
	}
	return 0
}

func (d *device) arm(o order) {
	if o.sequence == 0 || (d.executed && o.sequence == d.armed.sequence) {
		return
	}
	d.armed, d.executed, d.echo = o, false, o.sequence
	d.reject = d.judge(o)
	d.good = d.reject == 0
	d.say("armed", map[string]any{"sequence": o.sequence, "code": o.code, "reject": d.reject})
}

func (d *device) execute(number uint16) {
	if d.executed && number == d.armed.sequence {
		return
	}
	if number == 0 || number != d.armed.sequence || !d.good {
		d.reject = 4
		return
	}
	if d.reject = d.judge(d.armed); d.reject != 0 {
		return
	}
	d.endMotion(byCommand)
	d.executed = true
	d.move = d.begin(d.armed)
	d.running, d.moving = d.armed, true
	d.say("started", map[string]any{"sequence": number, "code": d.armed.code})
}

// A simple drive: it shows only the last state, has no quick stop of its own, and takes 0x000F as "on".
func (d *device) controlled(word uint16) {
	reset := word&0x80 != 0 && d.control&0x80 == 0
	d.control = word
	if d.drive == faulted {
		if reset {
			d.drive, d.fault = off, 0
			d.say("reset", nil)
		}
		return
	}
	switch {
	case word&0x06 != 0x06:
		d.endMotion(byCommand)
		if d.drive == reacting {
			d.drive = faulted
		} else {
			d.drive = off
		}
	case d.drive == reacting:
		return
	case word&0x0F == 0x0F:
		d.drive = enabled
	default:
		d.endMotion(byCommand)
		d.drive = ready
	}
	d.valve(d.on())
}

// ---- one control cycle

func (d *device) cycle(dt float64) {
	d.clock += dt
	limit := d.l.get(d.image[:], "watchdog_time") / 1000
	if writer, there := d.l.byName["writer"]; there && d.image[writer.address] != 0 && d.clock-d.writerSeen > 10 {
		d.say("writer-forgotten", map[string]any{"number": d.image[writer.address]})
		d.image[writer.address] = 0
	}
	late := limit > 0 && d.clock-d.fed > limit
	if late && (d.drive == enabled || (d.o.watchdogAlways && d.drive != faulted && d.drive != reacting && d.fed > 0)) {
		d.giveUp(1, byWatchdog)
	}
	if d.on() && d.moving {
		if reason := d.move(d, dt); reason != 0 && d.drive == reacting {
			d.moving, d.drive = false, faulted
			d.valve(false)
		} else if reason != 0 {
			d.endMotion(reason)
		}
	}
	d.plant.advance(d.command, dt)
	if d.drive == enabled && d.plant.measured > 1.02*d.l.get(d.image[:], "force_limit")+1 {
		d.giveUp(2, byLimit)
	} else if d.drive == enabled && d.plant.position > d.l.get(d.image[:], "stroke_limit")+1 {
		d.giveUp(3, byLimit)
	}
}

func (d *device) tick() uint32 { return uint32(uint64(math.Round(d.clock*1e6))) + d.o.tickStart }

func counts(value float64) int16 {
	return int16(math.Max(-32768, math.Min(32767, math.Round(value))))
}

// take makes the sample of this cycle. Force: 0.05 N a count. Draw wires: 0.01 mm a count from 20 mm on, signed.
func (d *device) take() {
	p := d.plant
	force := int32(math.Round((p.measured + 0.05*p.noise.NormFloat64()) * 20000))
	one := counts((p.stroke*0.9985+0.007*p.noise.NormFloat64())*100 + 2000)
	two := counts((p.stroke*1.0015+0.007*p.noise.NormFloat64())*100 + 2000)
	position, command := counts(p.position*100), counts(d.command*100)
	s := sample{sequence: d.sequence}
	put32(s.values[0:], uint32(force))
	s.values[2], s.values[3] = uint16(command), uint16(position)
	s.values[4], s.values[5] = uint16(one), uint16(two)
	put32(s.values[6:], d.tick())
	d.ring[d.made%uint64(len(d.ring))] = s
	d.made++
	d.produced++
	if d.truth != nil {
		binary.Write(d.truth, binary.LittleEndian, truthRow{uint32(d.sequence), d.tick(), force, one, two, position, command,
			float32(p.force), float32(p.stroke), d.state(), d.word(), d.boot, uint16(d.missed)})
	}
	d.sequence++
}

// ---- the edge of a scan

func (d *device) scan() {
	for _, p := range d.pending {
		switch p.what {
		case "block":
			d.arm(p.order)
		case "execute":
			d.execute(p.word)
		default:
			d.controlled(p.word)
		}
	}
	d.pending = d.pending[:0]
	d.publish()
}

func (d *device) state() uint16 {
	switch {
	case d.drive == faulted:
		return 6
	case d.drive == reacting:
		return 5
	case d.drive == off:
		return 0
	case d.drive != enabled:
		return 1
	case !d.moving:
		return 2
	}
	return map[uint16]uint16{codeHold: 2, codeRamp: 3, codeHarmonic: 4, codeStatic: 4, codeRelease: 5}[d.running.code]
}

func (d *device) word() uint16 { return d.drive | 0x10 | 0x200 }

func (d *device) publish() {
	put := func(name string, value float64) { d.l.put(d.image[:], name, value) }
	put("status_word", float64(d.word()))
	put("state", float64(d.state()))
	put("fault_code", float64(d.fault))
	put("echo_sequence", float64(d.echo))
	put("reject_code", float64(d.reject))
	put("done_sequence", float64(d.done))
	put("cycles_done", float64(d.cycles))
	put("heartbeat", float64(uint16(uint64(d.clock*100))))
	limit := d.l.get(d.image[:], "watchdog_time")
	put("watchdog_remaining", math.Max(0, limit-1000*(d.clock-d.fed)))
	put("watchdog_trips", float64(d.trips))
	put("end_reason", float64(d.reason))
	put("force", d.plant.measured)
	put("stroke", d.plant.stroke)
	put("position", d.plant.position)
	put("command", d.command)
	put("tick", float64(d.tick()))
	d.published = d.made
	close(d.edge)
	d.edge = make(chan struct{})
}

// crc is ISO-HDLC over registers, each high byte first.
func crc(pieces ...[]uint16) uint32 {
	var b []byte
	for _, piece := range pieces {
		for _, w := range piece {
			b = append(b, byte(w>>8), byte(w))
		}
	}
	return crc32.ChecksumIEEE(b)
}

// window puts together what the ring shows behind the acknowledged number.
func (d *device) window() []uint16 {
	w := make([]uint16, d.l.windowSize)
	asked := get32(d.image[d.l.byName["ring_acknowledge"].address:])
	oldest := uint64(0)
	if d.made > uint64(len(d.ring)) {
		oldest = d.made - uint64(len(d.ring))
	}
	from := d.published
	// back from the newest while what lies there is wanted still: numbers are compared around the wrap
	for from > oldest && int32(uint32(d.ring[(from-1)%uint64(len(d.ring))].sequence)-asked) >= 0 {
		from--
	}
	first, n := uint32(d.sequence), 0 // nothing to give: the number that comes next, also to who asks for a later one
	if d.published > 0 {
		first = uint32(d.ring[(d.published-1)%uint64(len(d.ring))].sequence + 1)
	}
	head := d.l.headerSize()
	if from < d.published {
		start := d.ring[from%uint64(len(d.ring))].sequence
		first = uint32(start)
		if first != asked && from == oldest && oldest > 0 {
			d.overruns++
		}
		for n < 14 && from+uint64(n) < d.published {
			s := &d.ring[(from+uint64(n))%uint64(len(d.ring))]
			if s.sequence != start+uint64(n) {
				break
			}
			copy(w[head+8*n:], s.values[:])
			n++
		}
	}
	h := w
	if !d.l.lean {
		put32(h, asked)
		h = h[2:]
	}
	put32(h, first)
	h[2], h[3], h[4] = uint16(n), d.overruns, d.image[statusAt]
	if !d.l.lean {
		put32(h[5:], crc(w[:head-2], w[head:head+8*n]))
	}
	return w
}

// registers gives n registers from an address, with what is made on reading.
func (d *device) registers(address, n int) []uint16 {
	if r, there := d.l.byName["request_echo"]; there {
		d.image[r.address] = d.image[d.l.byName["request_number"].address]
		put32(d.image[d.l.byName["status_check"].address:], crc(d.image[statusAt:r.address+1]))
	}
	if address+n > d.l.window {
		copy(d.image[d.l.window:], d.window())
	}
	return append([]uint16(nil), d.image[address:address+n]...)
}

// write takes registers that may be written; 3 refuses another program's number.
func (d *device) write(address int, values []uint16) byte {
	covers := func(name string) (int, bool) {
		r, there := d.l.byName[name]
		return r.address, there && address <= r.address && r.address < address+len(values)
	}
	if at, yes := covers("writer"); yes {
		asks, holds := values[at-address], d.image[at]
		if asks != 0 && holds != 0 && asks != holds {
			return 3
		}
		d.writerSeen = d.clock
		if asks != holds {
			d.say("writer", map[string]any{"number": asks})
		}
	}
	feed := d.image[d.l.byName["watchdog_feed"].address]
	copy(d.image[address:], values)
	if at, yes := covers("watchdog_feed"); yes && d.image[at] != feed {
		d.fed, d.writerSeen = d.clock, d.clock
	}
	if address <= blockAt && address+len(values) >= d.l.blockEnd {
		get := func(name string) float64 { return d.l.get(d.image[:], name) }
		d.pending = append(d.pending, pending{what: "block", order: order{
			sequence: d.image[blockAt], code: d.image[blockAt+1], target: get("target"), speed: get("speed"),
			mean: get("mean"), amplitude: get("amplitude"), frequency: get("frequency"), cycles: uint32(get("cycles")),
			turningForce: get("turning_force"), turningStroke: get("turning_stroke"), pause: get("static_pause")}})
	}
	if at, yes := covers("execute"); yes {
		d.pending = append(d.pending, pending{what: "execute", word: d.image[at]})
	}
	if at, yes := covers("control_word"); yes {
		d.pending = append(d.pending, pending{what: "control", word: d.image[at]})
	}
	return 0
}
