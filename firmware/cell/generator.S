; Clock edges, shipped: the code that is due goes out first, then the one for the next edge is computed. So the time
; from edge to DAC is the same in every mode; and the interrupt has high priority, so that the bus does not delay it.
;
; The state lives in registers that the compiler leaves alone (RESERVED in the Makefile). What is not the edge's
; handler touches more than one of them only with interrupts off, for a few cycles.
#include "attiny412.h"
#include "protocol.h"

#define state0  r2                      /* least significant byte first; state1:state0 and state3:state2 are pairs */
#define state1  r3
#define state2  r4
#define state3  r5
#define code    r6                      /* what the next edge puts out */
#define mode    r7                      /* as below */
#define counter r8                      /* as the next edge finds it */
#define factor0 r9                      /* MULTIPLIER, least significant byte first */
#define factor1 r14
#define factor2 r15
#define saved_r0 r10                    /* a pair: r1:r0 of what was interrupted */
#define saved_sreg r12
#define zero    r13
#define temp0   r16                     /* a pair */
#define temp1   r17

/* A pattern has no state: its registers hold where its bytes are and how many bits there are */
#define word    state0                  /* a pair */
#define length  state2

/* `mode` is the mode byte + 1, so that one bit tells the two modes that need the generator */
#define RASTER  1
#define BINARY  3
#define PATTERN 4
#define UNSEEDED 0
#define GENERATES 1                     /* set in analog and binary mode */
#define IS_BINARY 0                     /* between these two */
#define IS_PATTERN 2
#define IS_RASTER 0                     /* between the others */

#if MULTIPLIER >> 24 != 0
#error "advance multiplies by three bytes"
#endif
#if BINARY_THRESHOLD != 128 || CODE_LOW != 0 || CODE_HIGH != 255
#error "top_code and bit_code copy a bit to all eight"
#endif
#if MODE_RASTER + 1 != RASTER || MODE_ANALOG + 1 != 2 || MODE_BINARY + 1 != BINARY || MODE_PATTERN + 1 != PATTERN
#error "the bits of `mode` are those of other modes"
#endif
#if (MODE_UNSEEDED + 1) % 256 != UNSEEDED
#error "an unseeded cell has no bit of `mode`"
#endif

        .lcomm  own_address, 1

; a3:a0 = MULTIPLIER * a3:a0 + INCREMENT. The upper two bytes are made in place, from the top down, so that what is
; still needed is still there; the lower two in t1:t0. a1:a0 and t1:t0 are pairs, t0 and t1 upper registers. Uses r1:r0.
        .macro  advance a0, a1, a2, a3, t0, t1
        mul     \a3, factor0
        mov     \a3, r0
        mul     \a2, factor1
        add     \a3, r0
        mul     \a1, factor2
        add     \a3, r0
        mul     \a2, factor0
        mov     \a2, r0
        add     \a3, r1
        mul     \a1, factor1
        add     \a2, r0
        adc     \a3, r1
        mul     \a0, factor2
        add     \a2, r0
        adc     \a3, r1
        mul     \a0, factor0
        movw    \t0, r0
        mul     \a1, factor0
        add     \t1, r0
        adc     \a2, r1
        adc     \a3, zero
        mul     \a0, factor1
        add     \t1, r0
        adc     \a2, r1
        adc     \a3, zero
        ; there is no immediate addition
        subi    \t0, lo8(-INCREMENT)
        sbci    \t1, hi8(-INCREMENT)
        movw    \a0, \t0
        ldi     \t0, hlo8(-INCREMENT)
        sbc     \a2, \t0
        ldi     \t0, hhi8(-INCREMENT)
        sbc     \a3, \t0
        .endm

; to = code of the state whose top byte is `top`, in mode m: analog or binary.
        .macro  top_code to, top, m
        mov     \to, \top
        sbrs    \m, IS_BINARY
        rjmp    1f
        lsl     \to
        sbc     \to, \to
1:
        .endm

; t = code of the raster at the count t. Uses u.
        .macro  raster_code t, u
        lds     \u, own_address
        cp      \t, \u
        ldi     \t, CODE_NEUTRAL
        brne    1f
        ldi     \t, CODE_SELECTED
1:
        .endm

; to = code of the lowest bit of `byte`, which is shifted.
        .macro  bit_code to, byte
        lsr     \byte
        sbc     \to, \to
        .endm

; One edge. The flag is cleared at once, so that an edge during the computation is kept.
        .text
        .global __vector_porta
__vector_porta:
        sts     DAC0_DATA, code
        sbi     VPORTA_INTFLAGS, PIN_CLOCK
        in      saved_sreg, CPU_SREG
        sbrs    mode, GENERATES
        rjmp    plain_edge
        movw    saved_r0, r0
        advance state0, state1, state2, state3, temp0, temp1
        top_code code, state3, mode
        movw    r0, saved_r0
        out     CPU_SREG, saved_sreg
        reti

plain_edge:
        sbrs    mode, IS_RASTER
        rjmp    pattern_edge
        inc     counter
        ldi     temp0, COUNTER_LAST
        cp      counter, temp0
        brne    1f
        ldi     temp0, COUNTER_START
        mov     counter, temp0
1:      mov     temp0, counter
        inc     temp0
        raster_code temp0, temp1
        mov     code, temp0
edge_done:
        out     CPU_SREG, saved_sreg
        reti

; The byte with the bit that is next, then its nibble, then the bit; all RAM is one page, so that the upper half of the
; address does not change.
pattern_edge:
        sbrs    mode, IS_PATTERN
        rjmp    edge_done               ; unseeded: mid-scale stays
        inc     counter
        cp      counter, length
        brne    1f
        clr     counter
1:      mov     temp0, counter
        lsr     temp0
        lsr     temp0
        lsr     temp0
        movw    saved_r0, r30
        movw    r30, word
        add     r30, temp0
        ld      temp0, Z
        movw    r30, saved_r0
        sbrc    counter, 2
        swap    temp0
        sbrc    counter, 1
        lsr     temp0
        sbrc    counter, 1
        lsr     temp0
        sbrc    counter, 0
        lsr     temp0
        bit_code code, temp0
        out     CPU_SREG, saved_sreg
        reti

; void generator_start(uint8_t address)
        .global generator_start
generator_start:
        sts     own_address, r24
        clr     zero
        clr     state0
        clr     state1
        movw    state2, state0
        ldi     temp0, lo8(MULTIPLIER)
        mov     factor0, temp0
        ldi     temp0, hi8(MULTIPLIER)
        mov     factor1, temp0
        ldi     temp0, hlo8(MULTIPLIER)
        mov     factor2, temp0
        ldi     temp0, CODE_NEUTRAL
        mov     code, temp0
        ldi     temp0, UNSEEDED
        mov     mode, temp0
        ldi     temp0, COUNTER_START
        mov     counter, temp0
        ldi     temp0, VECTOR_PORTA
        sts     CPUINT_LVL1VEC, temp0
        ret

; void generator_seed(uint8_t mode, uint32_t seed): mode in r24, seed in r23:r20. The first code is computed before the
; change.
        .global generator_seed
generator_seed:
        inc     r24
        cpi     r24, RASTER
        breq    seed_raster
        advance r20, r21, r22, r23, r18, r19
        clr     r1                      ; C's zero
        top_code r18, r23, r24
        rjmp    seed_commit
seed_raster:
        ldi     r18, COUNTER_START + 1
        raster_code r18, r19
seed_commit:
        ldi     r19, COUNTER_START
        cli
        movw    state0, r20
        movw    state2, r22
        mov     mode, r24
        mov     code, r18
        mov     counter, r19
        sei
        nop                             ; a waiting edge comes after this, not after the long ret
        ret

; void generator_pattern(uint8_t length, const uint8_t *word): length in r24, word in r23:r22
        .global generator_pattern
generator_pattern:
        movw    r30, r22
        ld      r19, Z
        bit_code r18, r19
        ldi     r19, PATTERN
        cli
        movw    word, r22
        mov     length, r24
        mov     mode, r19
        mov     code, r18
        clr     counter
        sei
        nop
        ret

; void generator_snapshot(uint8_t *reply): reply in r25:r24. A pattern has no state, which reads 0.
        .global generator_snapshot
generator_snapshot:
        movw    r30, r24
        cli
        mov     r18, mode
        movw    r20, state0
        movw    r22, state2
        mov     r19, counter
        lds     r24, DAC0_DATA
        sei
        dec     r18                     ; short, as a waiting edge comes after it
        cpi     r18, MODE_PATTERN
        brne    1f
        clr     r20
        clr     r21
        movw    r22, r20
1:      st      Z+, r18
        st      Z+, r20
        st      Z+, r21
        st      Z+, r22
        st      Z+, r23
        st      Z+, r19
        st      Z, r24
        ret
