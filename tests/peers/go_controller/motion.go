package main

// The five motions of the documents.

import "math"

const (
	codeHold = iota + 1
	codeRamp
	codeHarmonic
	codeStatic
	codeRelease
)

const (
	byTarget   = 1
	byForce    = 2
	byCommand  = 3
	byWatchdog = 4
	byLimit    = 5
)

const unloadedKN = 0.2

type order struct {
	sequence, code                            uint16
	target, speed, mean, amplitude, frequency float64
	cycles                                    uint32
	turningForce, turningStroke, pause        float64
}

// A motion is a function of the period that passed; it returns the reason of its end, or 0.
type motion func(d *device, dt float64) int

func (d *device) toward(target, speed, dt float64) bool {
	left, step := target-d.command, speed*dt
	if math.Abs(left) <= step {
		d.command, d.commandSpeed = target, 0
		return true
	}
	d.commandSpeed = math.Copysign(speed, left)
	d.command += math.Copysign(step, left)
	return false
}

func (d *device) begin(o order) motion {
	switch o.code {
	case codeHold:
		braking := 0.0
		if d.running.code == codeHarmonic {
			w := 2 * math.Pi * d.running.frequency
			braking = d.running.amplitude * w * w
		}
		return func(d *device, dt float64) int {
			loss := braking * dt
			if math.Abs(d.commandSpeed) <= loss || braking == 0 {
				d.commandSpeed = 0
				return byTarget
			}
			d.commandSpeed -= math.Copysign(loss, d.commandSpeed)
			d.command += d.commandSpeed * dt
			return 0
		}
	case codeRamp:
		d.cycles = 0
		return func(d *device, dt float64) int {
			if d.toward(o.target, o.speed, dt) {
				return byTarget
			}
			return 0
		}
	case codeHarmonic:
		d.cycles = 0
		t := 0.0
		return func(d *device, dt float64) int { return harmonic(d, o, &t, dt) }
	case codeStatic:
		d.cycles = 0
		return staticCycles(o)
	default:
		d.cycles = 0
		return func(d *device, dt float64) int { return release(d, o.speed, dt) }
	}
}

func harmonic(d *device, o order, t *float64, dt float64) int {
	*t += dt
	cycle, all := *t*o.frequency, float64(o.cycles)+2
	before := d.command
	if cycle >= all {
		d.command, d.commandSpeed = o.mean, 0
		return byTarget
	}
	share := 1.0
	if cycle < 1 {
		share = (1 - math.Cos(math.Pi*cycle)) / 2
	} else if cycle > all-1 {
		share = (1 - math.Cos(math.Pi*(all-cycle))) / 2
	}
	d.command = o.mean + share*o.amplitude*math.Sin(2*math.Pi*cycle)
	d.commandSpeed = (d.command - before) / dt
	d.cycles = uint32(math.Max(0, math.Min(float64(o.cycles), math.Floor(cycle)-1)))
	return 0
}

func staticCycles(o order) motion {
	phase, rested, reason := "load", 0.0, 0
	return func(d *device, dt float64) int {
		switch phase {
		case "load":
			d.command += o.speed * dt
			d.commandSpeed = o.speed
			switch {
			case d.plant.measured >= o.turningForce:
				reason, phase = byForce, "unload"
			case d.plant.position >= o.turningStroke:
				reason, phase = byTarget, "unload"
			}
		case "unload":
			if d.toward(0, o.speed, dt) && d.plant.measured < unloadedKN {
				d.cycles++
				rested, phase = 0, "rest"
			}
		case "rest":
			if d.cycles >= o.cycles {
				return reason
			}
			if rested += dt; rested >= o.pause {
				phase = "load"
			}
		}
		return 0
	}
}

func release(d *device, speed, dt float64) int {
	if d.command > 0 {
		d.toward(0, speed, dt)
		return 0
	}
	if d.plant.measured < unloadedKN {
		d.commandSpeed = 0
		return byTarget
	}
	d.toward(-15, math.Min(speed, 2), dt)
	return 0
}
