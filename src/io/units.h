/* io/units.h -- plain numbers of a configuration. keller_parse_quantity is in keller/config.h. */
#ifndef KELLER_IO_UNITS_H
#define KELLER_IO_UNITS_H
#include <stdbool.h>
#include <stdint.h>

/* Reads a whole text as a decimal number without a unit (see keller_text_double); blanks around it are allowed. */
bool keller_parse_number(const char *text, double *value);

/* A whole number in [0, limit], digits only; blanks around it are allowed. */
bool keller_parse_count(const char *text, uint32_t limit, uint32_t *value);
#endif
