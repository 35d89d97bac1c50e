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
#define mode    r7
#define counter r8                      /* as the next edge finds it */
#define factor0 r9                      /* MULTIPLIER, least significant byte first */
#define factor1 r14
#define factor2 r15
#define saved_r0 r10                    /* a pair: r1:r0 of what was interrupted */
#define saved_sreg r12
#define zero    r13
#define temp0   r16                     /* a pair */
#define temp1   r17

#if MULTIPLIER >> 24 != 0
#error "advance multiplies by three bytes"
#endif
#if BINARY_THRESHOLD != 128 || CODE_LOW != 0 || CODE_HIGH != 255
#error "top_code copies the top bit to all eight"
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

; to = code of the state whose top byte is `top`, in mode m: analog (bit 0 set) or binary.
        .macro  top_code to, top, m
        mov     \to, \top
        sbrc    \m, 0
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

; One edge. The flag is cleared at once, so that an edge during the computation is kept.
        .text
        .global __vector_porta
__vector_porta:
        sts     DAC0_DATA, code
        sbi     VPORTA_INTFLAGS, PIN_CLOCK
        in      saved_sreg, CPU_SREG
        tst     mode
        breq    raster_edge
        brmi    edge_done               ; unseeded: mid-scale stays
        movw    saved_r0, r0
        advance state0, state1, state2, state3, temp0, temp1
        top_code code, state3, mode
        movw    r0, saved_r0
edge_done:
        out     CPU_SREG, saved_sreg
        reti

raster_edge:
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
        ldi     temp0, MODE_UNSEEDED
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
        cpi     r24, MODE_RASTER
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

; void generator_snapshot(uint8_t *reply): reply in r25:r24
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
        st      Z+, r18
        st      Z+, r20
        st      Z+, r21
        st      Z+, r22
        st      Z+, r23
        st      Z+, r19
        st      Z, r24
        ret
