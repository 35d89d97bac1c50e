; Clock edges, shipped: the code that is due goes out first, then the one for the next edge is computed. So the time from edge to DAC is
; the same in every mode; and the interrupt has high priority, so that the bus does not delay it.
;
; The state lives in registers that the compiler leaves alone (RESERVED in the Makefile). C changes or reads more than one of them only with
; interrupts off, for a few cycles.
#include "attiny412.h"
#include "protocol.h"

#define state0  r2                      /* least significant byte first */
#define state1  r3
#define state2  r4
#define state3  r5
#define code    r6                      /* what the next edge puts out */
#define mode    r7
#define counter r8                      /* as the next edge finds it */
#define address r9
#define saved_r0 r10                    /* and saved_r0 + 1: r1:r0 of what was interrupted */
#define saved_sreg r12
#define zero    r13
#define factor0 r14                     /* MULTIPLIER, least significant byte first */
#define factor1 r15
#define factor2 r16
#define temp    r17

#if MULTIPLIER >> 24 != 0
#error "advance multiplies by three bytes"
#endif
#if BINARY_THRESHOLD != 128 || CODE_LOW != 0 || CODE_HIGH != 255
#error "top_code copies the top bit to all eight"
#endif

; a3:a0 = MULTIPLIER * a3:a0 + INCREMENT, in place: from the top byte down, so that what is still needed is still there. Uses r1:r0 and t.
        .macro  advance a0, a1, a2, a3, t
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
        mul     \a1, factor0
        mov     \a1, r0
        add     \a2, r1
        adc     \a3, zero
        mul     \a0, factor1
        add     \a1, r0
        adc     \a2, r1
        adc     \a3, zero
        mul     \a0, factor0
        mov     \a0, r0
        add     \a1, r1
        adc     \a2, zero
        adc     \a3, zero
        ldi     \t, lo8(INCREMENT)
        add     \a0, \t
        ldi     \t, hi8(INCREMENT)
        adc     \a1, \t
        ldi     \t, hlo8(INCREMENT)
        adc     \a2, \t
        ldi     \t, hhi8(INCREMENT)
        adc     \a3, \t
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

; t = code of the raster at the count t.
        .macro  raster_code t
        cp      \t, address
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
        advance state0, state1, state2, state3, temp
        top_code code, state3, mode
        movw    r0, saved_r0
edge_done:
        out     CPU_SREG, saved_sreg
        reti

raster_edge:
        inc     counter
        ldi     temp, COUNTER_LAST
        cp      counter, temp
        brne    1f
        ldi     temp, COUNTER_START
        mov     counter, temp
1:      mov     temp, counter
        inc     temp
        raster_code temp
        mov     code, temp
        out     CPU_SREG, saved_sreg
        reti

; void generator_start(uint8_t address)
        .global generator_start
generator_start:
        mov     address, r24
        clr     zero
        clr     state0
        clr     state1
        movw    state2, state0
        ldi     temp, lo8(MULTIPLIER)
        mov     factor0, temp
        ldi     temp, hi8(MULTIPLIER)
        mov     factor1, temp
        ldi     factor2, hlo8(MULTIPLIER)
        ldi     temp, CODE_NEUTRAL
        mov     code, temp
        ldi     temp, MODE_UNSEEDED
        mov     mode, temp
        ldi     temp, COUNTER_START
        mov     counter, temp
        ldi     temp, VECTOR_PORTA
        sts     CPUINT_LVL1VEC, temp
        ret

; void generator_seed(uint8_t mode, uint32_t seed): mode in r24, seed in r23:r20. The first code is computed before the change.
        .global generator_seed
generator_seed:
        cpi     r24, MODE_RASTER
        breq    seed_raster
        advance r20, r21, r22, r23, r18
        clr     r1                      ; C's zero
        top_code r18, r23, r24
        rjmp    seed_commit
seed_raster:
        ldi     r18, COUNTER_START + 1
        raster_code r18
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
