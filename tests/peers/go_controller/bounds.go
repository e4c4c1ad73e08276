package main

// Go 1.21 has these by itself; Debian 12 has 1.19.

func min(a, b int) int {
	if b < a {
		return b
	}
	return a
}

func max(a, b float64) float64 {
	if b > a {
		return b
	}
	return a
}
