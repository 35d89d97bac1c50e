; Vector table and start-up. Clearing of .bss comes from libgcc, between .init2 and .init9.
#include "attiny412.h"

        .section .vectors, "ax", @progbits
        .global __vectors
__vectors:
        rjmp    __init
        .set    number, 1
        .rept   VECTOR_LAST
        .if     number == VECTOR_PORTA
        rjmp    __vector_porta
        .elseif number == VECTOR_TCA0_OVF
        rjmp    __vector_tca0_ovf
        .elseif number == VECTOR_TWI0_CLIENT
        rjmp    __vector_twi0_client
        .else
        rjmp    unexpected
        .endif
        .set    number, number + 1
        .endr

        .weak   __vector_tca0_ovf
        .set    __vector_tca0_ovf, unexpected

        .section .init2, "ax", @progbits
        .global __init
__init:
        clr     r1                      ; C's zero
        out     CPU_SREG, r1
        ldi     r28, lo8(SRAM_LAST)
        ldi     r29, hi8(SRAM_LAST)
        out     CPU_SPL, r28
        out     CPU_SPH, r29

        .section .init9, "ax", @progbits
        rjmp    main

; An interrupt that nothing enabled: start over, so that the cell is seen to be unseeded.
        .text
unexpected:
        ldi     r24, CPU_CCP_IOREG
        ldi     r25, RSTCTRL_SWRE
        out     CPU_CCP, r24
        sts     RSTCTRL_SWRR, r25
        rjmp    unexpected
