/* Which library of kernels a processor can run: the level of x86-64, or 0 on others. */
#include "kernels.h"

#if defined(__x86_64__)
#include <cpuid.h>

/* The registers that the operating system keeps for each thread. */
static uint64_t kept_registers(void) {
    uint32_t low, high;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low | (uint64_t)high << 32;
}

static bool has_all(uint32_t found, uint32_t wanted) { return (found & wanted) == wanted; }

/* Levels as in the x86-64 psABI, section 3.1.1; level 2 is required. */
KERNEL int64_t processor_level(void) {
    const uint32_t level_3 = bit_FMA | bit_MOVBE | bit_OSXSAVE | bit_AVX | bit_F16C;
    const uint32_t level_3_more = bit_AVX2 | bit_BMI | bit_BMI2;
    const uint32_t level_4 =
        bit_AVX512F | bit_AVX512BW | bit_AVX512CD | bit_AVX512DQ | bit_AVX512VL;
    const uint32_t lzcnt = 1 << 5;
    uint32_t a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !has_all(c, level_3)) return 2;
    if (!has_all((uint32_t)kept_registers(), 0x06)) return 2; /* of 128 and 256 bits */
    if (!__get_cpuid(0x80000001, &a, &b, &c, &d) || !has_all(c, lzcnt)) return 2;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !has_all(b, level_3_more)) return 2;
    if (!has_all(b, level_4)) return 3;
    return has_all((uint32_t)kept_registers(), 0xe6) ? 4 : 3; /* masks, and 512 bits */
}
#else
KERNEL int64_t processor_level(void) { return 0; }
#endif
