/* Registers of the ATtiny412 that the cell uses, for C and for the assembler.
 *
 * Addresses are in data space: peripheral base + register offset, as in the device description of the ATtiny412
 * (Microchip's ATDF file) and in the register summaries of its data sheet (DS40002287). AVRxt maps no CPU registers
 * into data space, so an I/O address equals the data address below 0x40. */
#ifndef ATTINY412_H
#define ATTINY412_H

#ifdef __ASSEMBLER__
#define REGISTER8(address) address
#define REGISTER16(address) address
#else
#include <stdint.h>
#define REGISTER8(address) (*(volatile uint8_t *)(address))
#define REGISTER16(address) (*(volatile uint16_t *)(address))
#endif

/* Memories */
#define SRAM_LAST 0x3FFF
#define EEPROM_FIRST REGISTER8(0x1400)

/* VPORTA: port A, reachable by single-cycle bit instructions */
#define VPORTA_INTFLAGS REGISTER8(0x0003)

/* CPU: configuration change protection, stack pointer, status */
#define CPU_CCP REGISTER8(0x0034)
#define CPU_CCP_IOREG 0xD8
#define CPU_SPL REGISTER8(0x003D)
#define CPU_SPH REGISTER8(0x003E)
#define CPU_SREG REGISTER8(0x003F)

/* RSTCTRL: reset controller */
#define RSTCTRL_SWRR REGISTER8(0x0041)
#define RSTCTRL_SWRE 0x01

/* SLPCTRL: sleep; mode 0 is idle */
#define SLPCTRL_CTRLA REGISTER8(0x0050)
#define SLPCTRL_SEN 0x01

/* CLKCTRL: main clock; PEN enables the prescaler */
#define CLKCTRL_MCLKCTRLB REGISTER8(0x0061)

/* VREF: 3 in DAC0REFSEL is 4.34 V */
#define VREF_CTRLA REGISTER8(0x00A0)
#define VREF_DAC0REFSEL_4V34 0x03

/* CPUINT: interrupt controller; LVL1VEC holds the number of the one vector of high priority */
#define CPUINT_LVL1VEC REGISTER8(0x0113)

/* PORTA: pins */
#define PORTA_PIN3CTRL REGISTER8(0x0413)
#define PORTA_PIN6CTRL REGISTER8(0x0416)
#define PORT_ISC_BOTHEDGES 0x01
#define PORT_ISC_INPUT_DISABLE 0x04

/* DAC0: 8 bits on PA6 */
#define DAC0_CTRLA REGISTER8(0x0680)
#define DAC0_DATA REGISTER8(0x0681)
#define DAC_ENABLE 0x01
#define DAC_OUTEN 0x40

/* TWI0: the client half; SDA is PA1, SCL is PA2 */
#define TWI0_SCTRLA REGISTER8(0x0819)
#define TWI0_SCTRLB REGISTER8(0x081A)
#define TWI0_SSTATUS REGISTER8(0x081B)
#define TWI0_SADDR REGISTER8(0x081C)
#define TWI0_SDATA REGISTER8(0x081D)
#define TWI_ENABLE 0x01  /* SCTRLA */
#define TWI_APIEN 0x40   /* SCTRLA: interrupt on address */
#define TWI_DIEN 0x80    /* SCTRLA: interrupt on data */
#define TWI_COMPTRANS 0x02 /* SCTRLB: done, wait for the next START */
#define TWI_RESPONSE 0x03  /* SCTRLB: acknowledge and go on */
#define TWI_AP 0x01      /* SSTATUS: address (1) or STOP (0) */
#define TWI_DIR 0x02     /* SSTATUS: the master reads */
#define TWI_COLL 0x08    /* SSTATUS: another client pulled SDA low */
#define TWI_RXACK 0x10   /* SSTATUS: the master did not acknowledge */
#define TWI_APIF 0x40    /* SSTATUS: address or STOP */
#define TWI_DIF 0x80     /* SSTATUS: data */

/* TCA0: 16-bit timer */
#define TCA0_CTRLA REGISTER8(0x0A00)
#define TCA0_INTCTRL REGISTER8(0x0A0A)
#define TCA0_INTFLAGS REGISTER8(0x0A0B)
#define TCA0_PER REGISTER16(0x0A26)
#define TCA_ENABLE 0x01
#define TCA_CLKSEL_DIV64 0x0A
#define TCA_OVF 0x01

/* Interrupt vectors used, by number: one flash word each */
#define VECTOR_PORTA 3
#define VECTOR_TCA0_OVF 8
#define VECTOR_TWI0_CLIENT 19
#define VECTOR_LAST 25

#endif
