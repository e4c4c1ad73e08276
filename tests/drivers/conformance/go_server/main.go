// A ring controller's register map behind a Go implementation of Modbus TCP (github.com/simonvetter/modbus).
//
// usage: go_server PORT. Prints "ready PORT" when it listens; ends when standard input does. That library has no
// function 23, so this controller is polled (profile "polling"): momentary values in the input table, whole
// numbers, low word first.
package main

import (
	"fmt"
	"io"
	"os"
	"sync"

	"github.com/simonvetter/modbus"
)

const (
	status  = 100
	command = 200
	execute = 211
	control = 220
	size    = 512
)

type device struct {
	lock    sync.Mutex
	holding [size]uint16
	polls   uint32
}

func newDevice() *device {
	d := &device{}
	// 0x4250, edition 1, -1234.5 and 0x12345678, serial 163: 32-bit values low word first.
	for i, word := range []uint16{0x4250, 1, 0x5000, 0xC49A, 0x5678, 0x1234, 163, 0} {
		d.holding[i] = word
	}
	d.holding[status] = 0x0240
	return d
}

func (d *device) obey(address, value uint16) {
	d.holding[address] = value
	switch address {
	case command:
		d.holding[status+3] = value // echo_sequence
	case command + 1:
		d.holding[status+4] = 0 // reject_code
		if value > 5 {
			d.holding[status+4] = 1
		}
	case execute:
		d.holding[status+5] = value // done_sequence: at once
		d.holding[status+9] = 1     // end_reason: reached
	case control:
		shown, state := uint16(0x0240), uint16(0)
		switch value {
		case 0x06:
			shown = 0x0231
		case 0x07:
			shown = 0x0233
		case 0x0F:
			shown, state = 0x0237, 2
		}
		d.holding[status], d.holding[status+1] = shown, state
	}
}

func (d *device) HandleHoldingRegisters(request *modbus.HoldingRegistersRequest) ([]uint16, error) {
	d.lock.Lock()
	defer d.lock.Unlock()
	if request.UnitId != 1 || int(request.Addr)+int(request.Quantity) > size {
		return nil, modbus.ErrIllegalDataAddress
	}
	if request.IsWrite {
		for i, value := range request.Args {
			d.obey(request.Addr+uint16(i), value)
		}
		return nil, nil
	}
	d.holding[status+7]++ // heartbeat
	return append([]uint16(nil), d.holding[request.Addr:request.Addr+request.Quantity]...), nil
}

func (d *device) HandleInputRegisters(request *modbus.InputRegistersRequest) ([]uint16, error) {
	d.lock.Lock()
	defer d.lock.Unlock()
	var input [16]uint16
	if int(request.Addr)+int(request.Quantity) > len(input) {
		return nil, modbus.ErrIllegalDataAddress
	}
	if request.Addr == 0 { // force is read first: a new sample
		d.polls++
	}
	force := d.polls * 70000
	input[0], input[1] = uint16(force), uint16(force>>16)
	input[10], input[11] = uint16(d.polls), uint16(d.polls+1)
	input[12], input[13] = uint16(-int(d.polls%30000)), uint16(d.polls%30000)
	return append([]uint16(nil), input[request.Addr:request.Addr+request.Quantity]...), nil
}

func (d *device) HandleCoils(*modbus.CoilsRequest) ([]bool, error) {
	return nil, modbus.ErrIllegalFunction
}

func (d *device) HandleDiscreteInputs(*modbus.DiscreteInputsRequest) ([]bool, error) {
	return nil, modbus.ErrIllegalFunction
}

func main() {
	server, err := modbus.NewServer(&modbus.ServerConfiguration{URL: "tcp://127.0.0.1:" + os.Args[1]}, newDevice())
	if err == nil {
		err = server.Start()
	}
	if err != nil {
		fmt.Fprintln(os.Stderr, err)
		os.Exit(2)
	}
	fmt.Println("ready " + os.Args[1])
	io.Copy(io.Discard, os.Stdin)
	server.Stop()
}
