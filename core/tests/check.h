/* Checks that count: a failed one says where, and the program ends with how many there were. */
#ifndef RUMO_CHECK_H
#define RUMO_CHECK_H

#include <stdio.h>

static long passed, failed;

#define CHECK(condition, ...)                                      \
    do {                                                           \
        if (condition) {                                           \
            ++passed;                                              \
        } else if (++failed <= 20) {                               \
            printf("%s:%d: %s: ", __FILE__, __LINE__, #condition); \
            printf(__VA_ARGS__);                                   \
            printf("\n");                                          \
        }                                                          \
    } while (0)

static int finish(void) {
    printf("%ld passed, %ld failed\n", passed, failed);
    return failed != 0 || passed == 0;
}

#endif
