/* Start of a cell: clock, DAC, clock pin, bus; then asleep between interrupts. */
#include "attiny412.h"
#include "bus.h"
#include "generator.h"
#include "protocol.h"

/* Full 20 MHz: after reset the clock is divided by six, too slow to follow the edges. The protected register takes a
 * write within four instructions of the key. */
static void clock_start(void)
{
    __asm__ volatile("out %0, %1\n\tsts %2, __zero_reg__"
                     :
                     : "I"(&CPU_CCP), "r"((uint8_t)CPU_CCP_IOREG), "n"(&CLKCTRL_MCLKCTRLB));
}

/* The DAC drives PA6 from now on, at mid-scale: a cell that has not been seeded is electrically silent. */
static void dac_start(void)
{
    PORTA_PIN6CTRL = PORT_ISC_INPUT_DISABLE;
    VREF_CTRLA = VREF_DAC0REFSEL_4V34;
    DAC0_DATA = CODE_NEUTRAL;
    DAC0_CTRLA = DAC_ENABLE | DAC_OUTEN;
}

int main(void)
{
    uint8_t address = EEPROM_FIRST;
    clock_start();
    dac_start();
    generator_start(address);
    bus_start(address);
    PORTA_PIN3CTRL = PORT_ISC_BOTHEDGES;
    SLPCTRL_CTRLA = SLPCTRL_SEN;
    __asm__ volatile("sei");
    for (;;)
        __asm__ volatile("sleep");
}
