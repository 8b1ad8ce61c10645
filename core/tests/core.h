/* The core under test, compiled by itself and linked to each test; and parts of it that tests use too. */
#ifndef RUMO_TEST_CORE_H
#define RUMO_TEST_CORE_H

#include "rumo_core.h"

#include "base/arena.h"
#include "base/copies.c"
#include "base/lanes.h"

extern const rumo_api rumo_core;

#endif
