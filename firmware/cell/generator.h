/* What puts out codes at clock edges. Two make the same values: generator.S (shipped) and generator_plain.c. */
#ifndef GENERATOR_H
#define GENERATOR_H

#include <stdint.h>

/* Starts unseeded, as the cell at `address`. Called once, with interrupts off. */
void generator_start(uint8_t address);

/* Starts over in `mode`, one of raster, analog, binary, from `seed`. The DAC changes at the next edge. */
void generator_seed(uint8_t mode, uint32_t seed);

/* Starts over with the `length` bits of `word`, which stay where they are until another start. The DAC changes at the next
 * edge. */
void generator_pattern(uint8_t length, const uint8_t *word);

/* Fills STATE_BYTES with the state between two edges. */
void generator_snapshot(uint8_t *reply);

#endif
