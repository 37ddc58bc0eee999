/* A plugin of qemu-user that counts the instructions that a program carries out, on aarch64 by kind.
 *
 * Built by benchmarks/pi.py. Debian has qemu's plugins but not their header; these are its declarations, of interface
 * version 1 (QEMU 7.2, include/qemu/qemu-plugin.h).
 */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct block;
struct instruction;
struct about {
    const char *target;
};
extern void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t, void (*)(uint64_t, struct block *));
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct block *, int, void *, uint64_t);
extern void qemu_plugin_register_atexit_cb(uint64_t, void (*)(uint64_t, void *), void *);
extern size_t qemu_plugin_tb_n_insns(const struct block *);
extern struct instruction *qemu_plugin_tb_get_insn(const struct block *, size_t);
extern const void *qemu_plugin_insn_data(const struct instruction *);
extern void qemu_plugin_outs(const char *);

int qemu_plugin_version = 1;

enum { INTEGER, BRANCH, MEMORY, VECTOR, KINDS };
static uint64_t counts[KINDS];
static int aarch64;

/* Bits 28 to 25 of an instruction: Arm Architecture Reference Manual, "A64 instruction set encoding". */
static int kind_of(const struct instruction *instruction)
{
    if (!aarch64)
        return INTEGER;
    unsigned group = *(const uint32_t *)qemu_plugin_insn_data(instruction) >> 25 & 15;
    if ((group & 5) == 4)
        return MEMORY;
    if ((group & 7) == 7)
        return VECTOR;
    return (group & 14) == 10 ? BRANCH : INTEGER;
}

static void translated(uint64_t id, struct block *block)
{
    uint64_t found[KINDS] = {0};
    (void)id;
    for (size_t i = 0; i < qemu_plugin_tb_n_insns(block); i++)
        found[kind_of(qemu_plugin_tb_get_insn(block, i))]++;
    for (int kind = 0; kind < KINDS; kind++)
        if (found[kind])
            qemu_plugin_register_vcpu_tb_exec_inline(block, 0, &counts[kind], found[kind]);
}

static void ended(uint64_t id, void *data)
{
    char line[100];
    (void)id, (void)data;
    snprintf(line, sizeof line, "%lu %lu %lu %lu\n", counts[INTEGER], counts[BRANCH], counts[MEMORY], counts[VECTOR]);
    qemu_plugin_outs(line);
}

int qemu_plugin_install(uint64_t id, const struct about *about, int argc, char **argv)
{
    (void)argc, (void)argv;
    aarch64 = about->target[0] == 'a';
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, ended, 0);
    return 0;
}
