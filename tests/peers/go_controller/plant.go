package main

// The machine: a piston under a loop with feed-forward and a dead time, a soft frame, and a spring of sliders.
//
// Spring: F(x) = E(x) + sum of five sliders (spring and friction element each, after Iwan), whose yield force grows with
// the stroke; E progressive from a preload, none without contact. Frame: position = stroke + F / 145 kN/mm.

import (
	"math"
	"math/rand"
)

const (
	frameKNPerMM  = 145.0
	loopPerS      = 45.0
	feedForward   = 0.6
	accelMMPerS2  = 20000.0
	topMMPerS     = 820.0
	deadSteps     = 3 // of the physics' own step
	physicsStepS  = 0.0005
	leakMMPerSPer = 0.025
)

type slider struct{ stiffness, yield, force float64 }

type plant struct {
	position, speed   float64
	stroke, force     float64
	measured          float64
	hum, humPhase     float64
	valveOpen         bool
	sliders           [5]slider
	commands          [deadSteps]float64
	lastCommand, rest float64
	noise             *rand.Rand
}

func newPlant(seed int64) *plant {
	p := &plant{noise: rand.New(rand.NewSource(seed))}
	for i := range p.sliders {
		p.sliders[i] = slider{stiffness: 1.2 / float64(i+1), yield: 1.0 + 0.6*float64(i)}
	}
	return p
}

func elastic(x float64) float64 {
	if x <= 0 {
		return 0
	}
	return 14*(1-math.Exp(-x/0.25)) + 55*(math.Exp(x/34)-1)
}

func (s *slider) after(dx, x float64) float64 {
	limit := s.yield * math.Max(0, math.Min(x/0.5, 0.4+x/30))
	return math.Max(-limit, math.Min(limit, s.force+s.stiffness*dx))
}

func (p *plant) forceAt(x float64) float64 {
	f := elastic(x)
	for i := range p.sliders {
		f += p.sliders[i].after(x-p.stroke, x)
	}
	return math.Max(0, f)
}

func (p *plant) balance() {
	x := p.position
	if x > 0 { // regula falsi between no force at all and a rigid frame
		low, high := 0.0, p.position
		for i := 0; i < 60; i++ {
			x = 0.5 * (low + high)
			if x+p.forceAt(x)/frameKNPerMM > p.position {
				high = x
			} else {
				low = x
			}
		}
	}
	dx := x - p.stroke
	p.force = p.forceAt(x)
	for i := range p.sliders {
		p.sliders[i].force = p.sliders[i].after(dx, x)
	}
	p.stroke = x
}

// advance moves the machine by dt with the set point going from its last value to this one.
func (p *plant) advance(command, dt float64) {
	n := int(math.Max(1, math.Round(dt/physicsStepS)))
	h := dt / float64(n)
	from := p.lastCommand
	for i := 1; i <= n; i++ {
		c := from + (command-from)*float64(i)/float64(n)
		slope := (command - from) / dt
		if p.valveOpen {
			delayed := p.commands[0]
			copy(p.commands[:], p.commands[1:])
			p.commands[deadSteps-1] = c
			wanted := loopPerS*(delayed-p.position) + feedForward*slope
			wanted = math.Max(-topMMPerS, math.Min(topMMPerS, wanted)) * (1 - p.force/2500)
			p.speed += math.Max(-accelMMPerS2*h, math.Min(accelMMPerS2*h, wanted-p.speed))
		} else {
			p.speed = -leakMMPerSPer * p.force
		}
		p.position += p.speed * h
		p.balance()
	}
	p.lastCommand = command
	p.humPhase += 2 * math.Pi * 50 * dt
	p.measured += (p.force + 0.02*math.Sin(p.humPhase) - p.measured) * (1 - math.Exp(-dt/0.003))
}

func (p *plant) openValve(open bool) {
	p.valveOpen = open
	p.speed = 0
	p.lastCommand = p.position
	for i := range p.commands {
		p.commands[i] = p.position
	}
}
