/* What a library must have on Windows if it is linked without the C runtime. */
#include "kernels.h"

#if defined(_WIN32)
/* Called when the library is loaded. */
int DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
    (void)module, (void)reason, (void)reserved;
    return 1;
}

/* Compilers call these two where a loop clears or copies memory. */
__attribute__((no_builtin("memset"))) void *memset(void *to, int value, size_t count) {
    unsigned char *bytes = to;
    for (size_t i = 0; i < count; i++) bytes[i] = (unsigned char)value;
    return to;
}

__attribute__((no_builtin("memcpy"))) void *memcpy(void *to, const void *from, size_t count) {
    unsigned char *bytes = to;
    for (size_t i = 0; i < count; i++) bytes[i] = ((const unsigned char *)from)[i];
    return to;
}
#endif
