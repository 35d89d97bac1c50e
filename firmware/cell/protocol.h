/* The cell's protocol: what a write says, what a clock edge puts out, what a read returns (README.md). */
#ifndef PROTOCOL_H
#define PROTOCOL_H

/* Addresses that a cell may have on the bus */
#define ADDRESS_FIRST 8
#define ADDRESS_LAST 119

/* Mode byte of a write; EXTENDED marks one that four seed bytes follow instead of one. A pattern has no seed: its number
 * of bits follows, then the bits */
#define MODE_RASTER 0
#define MODE_ANALOG 1
#define MODE_BINARY 2
#define MODE_PATTERN 3
#define MODE_UNSEEDED 0xFF
#define MODE_EXTENDED 0x80

/* Raster: the counter goes up at every edge, from START, and is START again after LAST */
#define COUNTER_START 7
#define COUNTER_LAST 107
#define CODE_SELECTED 255
#define CODE_NEUTRAL 126

/* Binary: 255 from this top byte on, else 0 */
#define BINARY_THRESHOLD 128
#define CODE_LOW 0
#define CODE_HIGH 255

/* Generator: state = MULTIPLIER * state + INCREMENT mod 2^32 (Numerical Recipes, "quick and dirty") */
#define MULTIPLIER 1664525
#define INCREMENT 1013904223

/* Pattern: at most so many bits, eight a byte, the lowest first; a bit that is set is CODE_HIGH, else CODE_LOW */
#define PATTERN_LAST 64
#define PATTERN_BYTES (PATTERN_LAST / 8)

/* Pins of port A */
#define PIN_CLOCK 3

/* Bytes of a read: mode, state (4, least significant first), counter, present DAC code; then number of bits of the pattern
 * and its bytes */
#define STATE_BYTES 7
#define REPLY_BYTES (STATE_BYTES + 1 + PATTERN_BYTES)

#endif
