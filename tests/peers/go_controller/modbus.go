package main

// Modbus TCP and RTU, standard library only. Each TCP connection has its own goroutine: a reply that is held delays no
// other connection.

import (
	"encoding/binary"
	"errors"
	"io"
	"math/rand"
	"net"
	"os"
	"syscall"
	"time"
	"unsafe"
)

type server struct {
	d        *device
	answered int
	clients  map[net.Conn]bool
	listener net.Listener
	terminal *os.File
	slave    *os.File
}

// answer carries a request out and gives the reply, both without address and checksum.
func (s *server) answer(pdu []byte) []byte {
	d := s.d
	refuse := func(code byte) []byte { return []byte{pdu[0] | 0x80, code} }
	word := func(i int) int { return int(binary.BigEndian.Uint16(pdu[i:])) }
	var readAt, reads, writeAt int
	var values []uint16
	take := func(from, n int) bool {
		for i := 0; i < n && from+2*i+1 < len(pdu); i++ {
			values = append(values, uint16(word(from+2*i)))
		}
		return n > 0 && len(values) == n
	}
	switch {
	case len(pdu) < 5:
		return refuse(3)
	case pdu[0] == 3:
		readAt, reads = word(1), word(3)
	case pdu[0] == 6:
		writeAt = word(1)
		take(3, 1)
	case pdu[0] == 16:
		writeAt = word(1)
		if len(pdu) < 8 || !take(6, word(3)) {
			return refuse(3)
		}
	case pdu[0] == 23 && !d.o.noFC23:
		if len(pdu) < 12 || !take(10, word(7)) {
			return refuse(3)
		}
		readAt, reads, writeAt = word(1), word(3), word(5)
	default:
		return refuse(1)
	}
	if reads > 125 || (pdu[0] != 6 && pdu[0] != 16 && reads == 0) {
		return refuse(3)
	}
	if (reads > 0 && (readAt < identityAt || readAt+reads > imageSize)) ||
		(len(values) > 0 && (writeAt < blockAt || writeAt+len(values) > d.l.window)) {
		return refuse(2)
	}
	d.Lock()
	if len(values) > 0 {
		if code := d.write(writeAt, values); code != 0 {
			d.Unlock()
			return refuse(code)
		}
		if d.o.scanMS <= 0 {
			d.scan()
		}
	}
	if d.o.replyAtEdge {
		edge := d.edge
		d.Unlock()
		<-edge
		d.Lock()
	}
	defer d.Unlock()
	if reads == 0 {
		return pdu[:5]
	}
	reply := []byte{pdu[0], byte(2 * reads)}
	for _, r := range d.registers(readAt, reads) {
		reply = append(reply, byte(r>>8), byte(r))
	}
	return reply
}

// hold waits until a reply may go; it says whether it is to be cut.
func (s *server) hold(came time.Time) bool {
	o := s.d.o
	s.d.Lock()
	s.answered++
	n := s.answered
	s.d.Unlock()
	ms := o.delayMS + o.jitterMS*rand.Float64()
	if o.lateEvery > 0 && n%o.lateEvery == 0 {
		ms += o.lateMS
	}
	time.Sleep(time.Until(came.Add(time.Duration(ms * 1e6))))
	return o.cutEvery > 0 && n%o.cutEvery == 0
}

func (s *server) tcp(c net.Conn) {
	defer func() {
		c.Close()
		s.d.Lock()
		delete(s.clients, c)
		s.d.Unlock()
	}()
	head := make([]byte, 7)
	for {
		if _, err := io.ReadFull(c, head); err != nil {
			return
		}
		length := int(binary.BigEndian.Uint16(head[4:]))
		if binary.BigEndian.Uint16(head[2:]) != 0 || length < 2 || length > 254 {
			return
		}
		pdu := make([]byte, length-1)
		if _, err := io.ReadFull(c, pdu); err != nil {
			return
		}
		came := time.Now()
		reply := []byte{pdu[0] | 0x80, 0x0B}
		if int(head[6]) == s.d.o.unit {
			reply = s.answer(pdu)
		}
		frame := append([]byte{head[0], head[1], 0, 0, 0, 0, head[6]}, reply...)
		binary.BigEndian.PutUint16(frame[4:], uint16(len(reply)+1))
		if s.hold(came) {
			c.Write(frame[:len(frame)*2/3])
			return
		}
		if _, err := c.Write(frame); err != nil {
			return
		}
	}
}

func (s *server) listen(port int) (int, error) {
	address := &net.TCPAddr{IP: net.IPv4(127, 0, 0, 1), Port: port}
	listener, err := net.ListenTCP("tcp4", address)
	if err != nil {
		return 0, err
	}
	s.listener = listener
	go func() {
		for {
			c, err := listener.Accept()
			if err != nil {
				return
			}
			s.d.Lock()
			s.clients[c] = true
			s.d.Unlock()
			go s.tcp(c)
		}
	}()
	return listener.Addr().(*net.TCPAddr).Port, nil
}

func (s *server) close() {
	s.listener.Close()
	s.d.Lock()
	for c := range s.clients {
		c.Close()
	}
	s.d.Unlock()
}

// ---- RTU on a pseudo-terminal

func crc16(b []byte) uint16 {
	crc := uint16(0xFFFF)
	for _, c := range b {
		crc ^= uint16(c)
		for i := 0; i < 8; i++ {
			if crc&1 == 1 {
				crc = crc>>1 ^ 0xA001
			} else {
				crc >>= 1
			}
		}
	}
	return crc
}

func ioctl(f *os.File, request uintptr, argument unsafe.Pointer) error {
	if _, _, code := syscall.Syscall(syscall.SYS_IOCTL, f.Fd(), request, uintptr(argument)); code != 0 {
		return code
	}
	return nil
}

func (s *server) openTerminal(link string) error {
	master, err := os.OpenFile("/dev/ptmx", os.O_RDWR|syscall.O_NOCTTY, 0)
	if err != nil {
		return err
	}
	var unlocked, number int32
	if err := ioctl(master, syscall.TIOCSPTLCK, unsafe.Pointer(&unlocked)); err != nil {
		return err
	}
	if err := ioctl(master, syscall.TIOCGPTN, unsafe.Pointer(&number)); err != nil {
		return err
	}
	path := "/dev/pts/" + itoa(int(number))
	if s.slave, err = os.OpenFile(path, os.O_RDWR|syscall.O_NOCTTY, 0); err != nil {
		return err
	}
	var t syscall.Termios
	if err := ioctl(s.slave, syscall.TCGETS, unsafe.Pointer(&t)); err != nil {
		return err
	}
	t.Iflag, t.Oflag, t.Lflag = 0, 0, 0
	t.Cflag = t.Cflag&^(syscall.CSIZE|syscall.PARENB) | syscall.CS8
	if err := ioctl(s.slave, syscall.TCSETS, unsafe.Pointer(&t)); err != nil {
		return err
	}
	s.terminal = master
	os.Remove(link)
	return os.Symlink(path, link)
}

// frameLength tells how long a request is once its head is there; 0: not yet known.
func frameLength(b []byte) int {
	switch {
	case len(b) < 2:
		return 0
	case b[1] == 16 && len(b) >= 7:
		return 9 + int(b[6])
	case b[1] == 23 && len(b) >= 11:
		return 13 + int(b[10])
	case b[1] == 16 || b[1] == 23:
		return 0
	}
	return 8
}

func (s *server) characters(n int) time.Duration {
	return time.Duration(float64(n) * 11e9 / float64(s.d.o.baud))
}

func (s *server) rtu() {
	var heard []byte
	chunks := make(chan []byte, 64)
	go func() {
		for {
			b := make([]byte, 256)
			n, err := s.terminal.Read(b)
			if err != nil {
				close(chunks)
				return
			}
			chunks <- b[:n]
		}
	}()
	for {
		silence := time.After(20 * time.Millisecond)
		select {
		case b, open := <-chunks:
			if !open {
				return
			}
			heard = append(heard, b...)
		case <-silence: // what is no whole frame by now never will be
			heard = nil
			continue
		}
		n := frameLength(heard)
		if n == 0 || len(heard) < n {
			continue
		}
		frame := heard[:n]
		heard = append([]byte(nil), heard[n:]...)
		if crc16(frame[:n-2]) != uint16(frame[n-2])|uint16(frame[n-1])<<8 || int(frame[0]) != s.d.o.unit {
			continue
		}
		time.Sleep(s.characters(n) + s.characters(4)) // the request and the silence behind it take the line, too
		s.d.Lock()
		down := s.d.down
		s.d.Unlock()
		if down {
			continue
		}
		came := time.Now()
		reply := append([]byte{frame[0]}, s.answer(frame[1:n-2])...)
		sum := crc16(reply)
		reply = append(reply, byte(sum), byte(sum>>8))
		if s.hold(came) {
			reply = reply[:len(reply)*2/3]
		}
		start := time.Now()
		for i := 0; i < len(reply); i += 32 { // as a line delivers it: bit by bit
			end := min(i+32, len(reply))
			time.Sleep(time.Until(start.Add(s.characters(end))))
			if _, err := s.terminal.Write(reply[i:end]); err != nil && !errors.Is(err, syscall.EAGAIN) {
				return
			}
		}
	}
}
