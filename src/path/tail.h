/* The statistical end of a room's response, where it was asked for. */
#ifndef KELLER_PATH_TAIL_H
#define KELLER_PATH_TAIL_H
#include "keller/response.h"
#include "path/internal.h"

/* Adds noise to response->pressure that decays as Eyring has it, with the energy that paths of as many specular
 * reflections as were asked for lack, and keeps it apart in response->tail (malloc'd). `media` as for keller_path_transfer at each of the
 * octave bands of TAIL_BANDS; the same call gives the same noise. False: memory. */
enum { TAIL_BANDS = 11 };
double tail_band(int band); /* Hz: exact middles of the octaves from 16 Hz to 16 kHz */
bool tail_add(const KellerConfig *config, const KellerScene *scene, const KellerMedium *media, KellerResponse *response);
#endif
