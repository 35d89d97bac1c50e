#ifndef BUS_H
#define BUS_H

#include <stdint.h>

/* Listens at `address`; stays silent if no cell can have it. */
void bus_start(uint8_t address);

#endif
