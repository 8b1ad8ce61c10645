/* What the core needs of the C library. Included before any other header of it, since it says which functions there are. */
#ifndef RUMO_SYSTEM_H
#define RUMO_SYSTEM_H

#if !defined(_WIN32) && !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L
#endif

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#endif
