package main

// The register map: this controller's own, told to bufferstand by a profile that it prints itself (--print-profile).
//
// As docs/drivers.md allows it, addresses, types, scales and word order differ from the shipped ring.toml: low word
// first, whole numbers with a scale in place of floats, its samples in another order. The lean map leaves out all that
// "may be left out".

import (
	"fmt"
	"math"
	"strings"
)

type register struct {
	name, kind, access, unit string
	scale                    float64 // units per count; 0: the number itself
	expect                   string
	address                  int
}

type layout struct {
	registers           []register
	byName              map[string]register
	lean                bool
	window, windowSize  int
	header              []string
	statusEnd, blockEnd int // first address behind the status, behind the command block
}

const (
	identityAt = 1000
	statusAt   = 1100
	blockAt    = 1200
	controlAt  = 1300
	ringAt     = 1400
	imageSize  = 1600
)

func words(kind string) int {
	if strings.HasSuffix(kind, "32") {
		return 2
	}
	return 1
}

func newLayout(lean bool) *layout {
	l := &layout{byName: map[string]register{}, lean: lean}
	at := identityAt
	add := func(name, kind, access, unit string, scale float64, expect string, optional bool) {
		if optional && lean {
			return
		}
		r := register{name, kind, access, unit, scale, expect, at}
		l.registers = append(l.registers, r)
		l.byName[name] = r
		at += words(kind)
	}
	add("device_type", "u16", "r", "", 0, "0x60C1", false)
	add("profile_version", "u16", "r", "", 0, "9", false)
	add("test_float", "f32", "r", "", 0, "-1234.5", false)
	add("test_integer", "u32", "r", "", 0, "0x12345678", false)
	add("serial", "u32", "r", "", 0, "", false)
	add("sample_rate", "u32", "r", "Hz", 0.001, "", false)
	at = statusAt
	add("status_word", "u16", "r", "", 0, "", false)
	add("state", "u16", "r", "", 0, "", false)
	add("fault_code", "u16", "r", "", 0, "", false)
	add("echo_sequence", "u16", "r", "", 0, "", false)
	add("reject_code", "u16", "r", "", 0, "", false)
	add("done_sequence", "u16", "r", "", 0, "", false)
	add("cycles_done", "u32", "r", "", 0, "", false)
	add("heartbeat", "u16", "r", "", 0, "", false)
	add("watchdog_remaining", "u16", "r", "ms", 0, "", false)
	add("watchdog_trips", "u16", "r", "", 0, "", false)
	add("end_reason", "u16", "r", "", 0, "", false)
	add("force", "i32", "r", "kN", 0.001, "", false)
	add("stroke", "i32", "r", "mm", 0.001, "", false)
	add("position", "i32", "r", "mm", 0.001, "", false)
	add("command", "i32", "r", "mm", 0.001, "", false)
	add("tick", "u32", "r", "us", 0, "", false)
	add("request_echo", "u16", "r", "", 0, "", true)
	add("status_check", "u32", "r", "", 0, "", true)
	l.statusEnd = at
	at = blockAt
	add("command_sequence", "u16", "rw", "", 0, "", false)
	add("command_code", "u16", "rw", "", 0, "", false)
	add("target", "i32", "rw", "mm", 0.001, "", false)
	add("speed", "u32", "rw", "mm/s", 0.001, "", false)
	add("mean", "i32", "rw", "mm", 0.001, "", false)
	add("amplitude", "u32", "rw", "mm", 0.001, "", false)
	add("frequency", "u32", "rw", "Hz", 0.0001, "", false)
	add("cycles", "u32", "rw", "", 0, "", false)
	add("turning_force", "u32", "rw", "kN", 0.001, "", false)
	add("turning_stroke", "i32", "rw", "mm", 0.001, "", false)
	add("static_pause", "u32", "rw", "s", 0.001, "", false)
	l.blockEnd = at
	add("execute", "u16", "rw", "", 0, "", false)
	at = controlAt
	add("control_word", "u16", "rw", "", 0, "", false)
	add("watchdog_feed", "u16", "rw", "", 0, "", false)
	add("watchdog_time", "u16", "rw", "ms", 0, "", false)
	add("force_limit", "u32", "rw", "kN", 0.001, "", false)
	add("stroke_limit", "i32", "rw", "mm", 0.001, "", false)
	add("request_number", "u16", "rw", "", 0, "", true)
	add("writer", "u16", "rw", "", 0, "", true)
	at = ringAt
	add("ring_acknowledge", "u32", "rw", "", 0, "", false)
	l.window = at
	l.header = []string{"first_sequence:u32", "count:u16", "overruns:u16", "status_word:u16"}
	if !lean {
		l.header = append([]string{"asked:u32"}, append(l.header, "check:u32")...)
	}
	l.windowSize = l.headerSize() + 14*8
	return l
}

func (l *layout) headerSize() int {
	n := 0
	for _, field := range l.header {
		n += words(field)
	}
	return n
}

// The sample's own order: see (*device).window.
const sampleFields = `"force:i32", "command:i16", "position:i16", "stroke_1:i16", "stroke_2:i16", "tick:u32"`

func (l *layout) profile() string {
	var b strings.Builder
	id := "go-ring"
	if l.lean {
		id = "go-ring-lean"
	}
	fmt.Fprintf(&b, "[profile]\nid = %q\nedition = \"9\"\nword_order = \"little\"\n", id)
	fmt.Fprintf(&b, "description = \"Printed by the controller itself\"\n\n")
	for _, r := range l.registers {
		fmt.Fprintf(&b, "[[register]]\nname = %q\naddress = %d\ntype = %q\naccess = %q\n", r.name, r.address, r.kind, r.access)
		if r.unit != "" {
			fmt.Fprintf(&b, "unit = %q\n", r.unit)
		}
		if r.scale != 0 {
			fmt.Fprintf(&b, "scale = %g\n", r.scale)
		}
		if r.expect != "" {
			fmt.Fprintf(&b, "expect = %s\n", r.expect)
		}
	}
	fmt.Fprintf(&b, "\n[ring]\naddress = %d\nregisters = %d\nheader = [\"%s\"]\nsample = [%s]\ntick_unit = \"us\"\n",
		l.window, l.windowSize, strings.Join(l.header, "\", \""), sampleFields)
	return b.String()
}

func put32(at []uint16, value uint32) { at[0], at[1] = uint16(value), uint16(value>>16) }
func get32(at []uint16) uint32        { return uint32(at[1])<<16 | uint32(at[0]) }

// put writes a value in its unit as the register's counts.
func (l *layout) put(image []uint16, name string, value float64) {
	r, there := l.byName[name]
	if !there {
		return
	}
	if r.scale != 0 {
		value /= r.scale
	}
	switch r.kind {
	case "f32":
		put32(image[r.address:], math.Float32bits(float32(value)))
	case "u16":
		image[r.address] = uint16(int64(value))
	default:
		put32(image[r.address:], uint32(int64(math.RoundToEven(value))))
	}
}

func (l *layout) get(image []uint16, name string) float64 {
	r, there := l.byName[name]
	if !there {
		return 0
	}
	var value float64
	switch r.kind {
	case "u16":
		value = float64(image[r.address])
	case "i32":
		value = float64(int32(get32(image[r.address:])))
	default:
		value = float64(get32(image[r.address:]))
	}
	if r.scale != 0 {
		value *= r.scale
	}
	return value
}
