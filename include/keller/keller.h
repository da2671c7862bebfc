/* keller/keller.h -- the whole public interface. */
#ifndef KELLER_KELLER_H
#define KELLER_KELLER_H
#include "keller/accel.h"
#include "keller/antenna.h"
#include "keller/cone.h"
#include "keller/config.h"
#include "keller/drape.h"
#include "keller/error.h"
#include "keller/geo.h"
#include "keller/material.h"
#include "keller/nexthit.h"
#include "keller/path.h"
#include "keller/ray.h"
#include "keller/resolve.h"
#include "keller/response.h"
#include "keller/result.h"
#include "keller/scene.h"
#include "keller/sound.h"
#include "keller/soup.h"
#include "keller/vec.h"
#include "keller/wave.h"
#endif
