/* Runs a fuzz target on files: for compilers without libFuzzer. */
#include "check.h"
#include "stream.h"

int main(int count, char **paths) {
    for (int i = 1; i < count; ++i) {
        FILE *file = fopen(paths[i], "rb");
        CHECK(file != NULL, "%s", paths[i]);
        if (!file) continue;
        static uint8_t data[1 << 16];
        const size_t size = fread(data, 1, sizeof data, file);
        fclose(file);
        CHECK(LLVMFuzzerTestOneInput(data, size) == 0, "%s", paths[i]);
    }
    return finish();
}
