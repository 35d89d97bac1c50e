/* Clock edges the plain way: the handler computes, then puts out, at the priority of every other interrupt, beside a
 * millisecond timer like that of an Arduino core. The code of an edge is late by the computation and by whatever
 * handler is running when it comes. */
#include "attiny412.h"
#include "generator.h"
#include "protocol.h"

static uint8_t own_address;
static uint8_t mode;
static uint8_t counter;
static uint32_t state;
static uint8_t length;
static const uint8_t *word;

/* The timer's books: milliseconds, the microseconds beyond them, and overflows */
static volatile uint32_t milliseconds;
static volatile uint16_t fraction_us;
static volatile uint32_t overflows;

/* Counts of the timer a period, each 64 cycles: 16320 cycles, 816 us */
#define TIMER_COUNTS 255
#define TIMER_PERIOD_US 816

void generator_start(uint8_t address)
{
    own_address = address;
    mode = MODE_UNSEEDED;
    counter = COUNTER_START;
    TCA0_PER = TIMER_COUNTS - 1;
    TCA0_INTCTRL = TCA_OVF;
    TCA0_CTRLA = TCA_CLKSEL_DIV64 | TCA_ENABLE;
}

void generator_seed(uint8_t new_mode, uint32_t seed)
{
    mode = new_mode;
    counter = COUNTER_START;
    state = seed;
}

void generator_pattern(uint8_t new_length, const uint8_t *new_word)
{
    mode = MODE_PATTERN;
    counter = 0;
    state = 0;
    length = new_length;
    word = new_word;
}

static uint32_t next(uint32_t from)
{
    return from * MULTIPLIER + INCREMENT;
}

void generator_snapshot(uint8_t *reply)
{
    union {
        uint32_t value;
        uint8_t bytes[4];
    } ahead = { mode == MODE_ANALOG || mode == MODE_BINARY ? next(state) : state };
    *reply++ = mode;
    for (uint8_t k = 0; k < sizeof ahead.bytes; k++)
        *reply++ = ahead.bytes[k];
    *reply++ = counter;
    *reply = DAC0_DATA;
}

static uint8_t raster_code(void)
{
    counter++;
    uint8_t code = counter == own_address ? CODE_SELECTED : CODE_NEUTRAL;
    if (counter == COUNTER_LAST)
        counter = COUNTER_START;
    return code;
}

static uint8_t pattern_code(void)
{
    uint8_t code = word[counter >> 3] & 1 << (counter & 7) ? CODE_HIGH : CODE_LOW;
    counter++;
    if (counter == length)
        counter = 0;
    return code;
}

static uint8_t edge_code(void)
{
    if (mode == MODE_UNSEEDED)
        return CODE_NEUTRAL;
    if (mode == MODE_RASTER)
        return raster_code();
    if (mode == MODE_PATTERN)
        return pattern_code();
    state = next(state);
    uint8_t top = state >> 24;
    if (mode == MODE_ANALOG)
        return top;
    return top < BINARY_THRESHOLD ? CODE_LOW : CODE_HIGH;
}

__attribute__((signal, used)) void __vector_porta(void)
{
    VPORTA_INTFLAGS = 1 << PIN_CLOCK;
    DAC0_DATA = edge_code();
}

__attribute__((signal, used)) void __vector_tca0_ovf(void)
{
    uint16_t fraction = fraction_us + TIMER_PERIOD_US;
    if (fraction >= 1000) {
        fraction -= 1000;
        milliseconds++;
    }
    fraction_us = fraction;
    overflows++;
    TCA0_INTFLAGS = TCA_OVF;
}
