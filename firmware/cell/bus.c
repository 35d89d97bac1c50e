/* I2C client: takes mode and seed, or a pattern, answers with the state. One interrupt a byte; the clock line is held until it is
 * answered. */
#include "bus.h"
#include "attiny412.h"
#include "generator.h"
#include "protocol.h"

/* Bytes of the present transaction done so far: of a pair when writing, of the reply when reading */
static uint8_t position;
static uint8_t mode;
static union {
    uint8_t bytes[4]; /* least significant first, as the CPU stores it */
    uint32_t value;
} seed;
static uint8_t reply[STATE_BYTES];

/* One is put out, or was last; the other takes what is being written, so that no edge meets half a pattern. */
static struct pattern {
    uint8_t length;
    uint8_t word[PATTERN_BYTES];
} patterns[2];
static uint8_t active;

void bus_start(uint8_t address)
{
    if (address < ADDRESS_FIRST || address > ADDRESS_LAST)
        return;
    TWI0_SADDR = address << 1;
    TWI0_SCTRLA = TWI_ENABLE | TWI_APIEN | TWI_DIEN;
}

/* A byte behind the mode of a pattern. The pattern acts before its last byte is acknowledged. */
static void take_pattern(uint8_t byte)
{
    struct pattern *next = &patterns[active ^ 1];
    if (position == 1) {
        if (byte == 0 || byte > PATTERN_LAST) {
            position = 0;
            return;
        }
        next->length = byte;
        for (uint8_t k = 0; k < PATTERN_BYTES; k++)
            next->word[k] = 0;
        position = 2;
        return;
    }
    next->word[position - 2] = byte;
    if (next->length > 8 * (position - 1)) {
        position++;
        return;
    }
    position = 0;
    active ^= 1;
    generator_pattern(next->length, next->word);
}

/* One byte written by the master. A pair acts before its last byte is acknowledged. */
static void take(uint8_t byte)
{
    if (position == 0) {
        mode = byte;
        seed.value = 0;
        position = 1;
        return;
    }
    if (mode == MODE_PATTERN) {
        take_pattern(byte);
        return;
    }
    seed.bytes[position - 1] = byte;
    uint8_t plain_mode = mode & (uint8_t)~MODE_EXTENDED;
    uint8_t known = plain_mode <= MODE_BINARY;
    if (known && mode != plain_mode && position < sizeof seed.bytes) {
        position++;
        return;
    }
    position = 0;
    if (known)
        generator_seed(plain_mode, seed.value);
}

/* Next byte of the reply; the idle level of the bus after its end. */
static uint8_t give(void)
{
    if (position < STATE_BYTES)
        return reply[position++];
    if (position >= REPLY_BYTES)
        return 0xFF;
    const uint8_t *pattern = &patterns[active].length;
    return pattern[position++ - STATE_BYTES];
}

__attribute__((signal, used)) void __vector_twi0_client(void)
{
    uint8_t status = TWI0_SSTATUS;
    uint8_t command = TWI_RESPONSE;
    if (status & TWI_APIF) {
        if (!(status & TWI_AP)) {
            /* STOP: not asked for, but its flag is the same */
            TWI0_SSTATUS = TWI_APIF;
            return;
        }
        /* START or repeated START: what was left of a pair is dropped. */
        position = 0;
        if (status & TWI_DIR)
            generator_snapshot(reply);
    } else if (!(status & TWI_DIR)) {
        take(TWI0_SDATA);
    } else if (position != 0 && (status & (TWI_RXACK | TWI_COLL))) {
        /* RXACK before the first byte is of an earlier read. */
        command = TWI_COMPTRANS;
    } else {
        TWI0_SDATA = give();
    }
    TWI0_SCTRLB = command;
}
