/* Files of data/ that are compiled into the program (made by embed.py): NUL-terminated text and its length without the
 * NUL. */
#ifndef KELLER_BASE_EMBEDDED_H
#define KELLER_BASE_EMBEDDED_H
extern const char keller_data_keller_rng[];
extern const unsigned long keller_data_keller_rng_length;
extern const char keller_data_itu_r_p2040_csv[];
extern const unsigned long keller_data_itu_r_p2040_csv_length;
#endif
