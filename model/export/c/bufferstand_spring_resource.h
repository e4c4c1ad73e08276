/* bufferstand_spring_resource.h: the curves of one spring, read from the FMU's folder of resources.
 *
 * Copyright (c) 2026, the bufferstand maintainers. SPDX-License-Identifier: BSD-3-Clause
 *
 * File spring.bin (written by model/export/fmu.py), little-endian:
 *     0  8 bytes  "BSSPRNG2"
 *     8  uint32   0x01020304
 *    12  uint32   number of cells n
 *    16  uint32   CRC-32 (zlib) of all bytes from 24 on
 *    20  uint32   0
 *    24  40 bytes GUID of the FMU, padded with zeros
 *    64  double   BS_HEAD numbers, then 8 tables of n + 1 doubles in the order of bs_cell
 */
#ifndef BUFFERSTAND_SPRING_RESOURCE_H
#define BUFFERSTAND_SPRING_RESOURCE_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <wchar.h>
#include <windows.h>
#endif

#include "bufferstand_spring.h"

#define BS_PARAMETERS 14
#define BS_FLAGS 3
#define BS_RANGE 11
#define BS_HEAD (6 + BS_RANGE + BS_PARAMETERS + BS_FLAGS)
#define BS_TABLES 8
#define BS_GUID 40

typedef struct {
    bs_table table;
    bs_cell *cells; /* owned */
    char guid[BS_GUID];
    uint32_t crc;
    double reference_C;
    double mm_per_stroke, force_per_kN; /* units of the FMU's variables */
    double range[BS_RANGE];             /* where it was identified, in the FMU's units; infinite: nobody says */
    double parameter[BS_PARAMETERS];    /* start values, in the order of the value references */
    double flag[BS_FLAGS];
} bs_resource;

static uint32_t bs_crc_(uint32_t crc, const unsigned char *bytes, size_t count)
{
    size_t k;
    int bit;
    crc = ~crc;
    for (k = 0; k < count; ++k) {
        crc ^= bytes[k];
        for (bit = 0; bit < 8; ++bit)
            crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
    }
    return ~crc;
}

static int bs_hex_(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Path of a file in the folder that a URI (file:///a%20b, file:/a, file://host/share) or plain path names.
 * The caller frees it; NULL if there is no memory. */
static char *bs_path_of(const char *uri, const char *file, int windows)
{
    const int is_uri = strncmp(uri, "file:", 5) == 0;
    char *path = malloc(strlen(uri) + strlen(file) + 2), *out = path;
    const char *in = uri;
    if (!path)
        return NULL;
    if (is_uri) {
        in += 5;
        if (strncmp(in, "//", 2) == 0) {
            if (strncmp(in + 2, "localhost/", 10) == 0)
                in += 11;
            else if (in[2] == '/')
                in += 2;
            /* else a host: //host/share stays as it is */
        }
        if (windows && in[0] == '/' && in[1] && (in[2] == ':' || in[2] == '|'))
            ++in; /* /C:/folder */
    }
    while (*in) {
        if (is_uri && *in == '%' && bs_hex_(in[1]) >= 0 && bs_hex_(in[2]) >= 0) {
            *out++ = (char)(16 * bs_hex_(in[1]) + bs_hex_(in[2]));
            in += 3;
        } else
            *out++ = *in++;
    }
    if (windows && is_uri && out - path >= 2 && path[1] == '|')
        path[1] = ':';
    if (out > path && out[-1] != '/' && !(windows && out[-1] == '\\'))
        *out++ = '/';
    strcpy(out, file);
    return path;
}

static FILE *bs_open_(const char *utf8)
{
#ifdef _WIN32
    FILE *file = NULL;
    const int length = MultiByteToWideChar(CP_UTF8, 0, utf8, -1, NULL, 0);
    wchar_t *wide = length > 0 ? malloc((size_t)length * sizeof *wide) : NULL;
    if (wide && MultiByteToWideChar(CP_UTF8, 0, utf8, -1, wide, length) > 0)
        file = _wfopen(wide, L"rb");
    free(wide);
    return file;
#else
    return fopen(utf8, "rb");
#endif
}

/* Lay the tables side by side, value and slope; say what a spring's tables cannot be. */
static const char *bs_lay_(bs_resource *r, const double *tables)
{
    const size_t n = r->table.cells;
    double *cell = (double *)r->cells;
    size_t i, k;
    for (k = 0; k < BS_TABLES; ++k) {
        const double *table = tables + k * (n + 1);
        for (i = 0; i <= n; ++i) {
            const int curve = k == 0 || k == 1; /* the integrals must not fall */
            if (!(fabs(table[i]) <= BS_MOST) || table[i] < 0.0 || (curve && i && table[i] < table[i - 1]))
                return "holds a value that no spring has";
            if ((k == 5 || k == 7) && table[i] > 1.0)
                return "holds a share above 1";
            cell[i * 2 * BS_TABLES + 2 * k] = table[i];
            /* The last stroke falls into a cell of its own, with the slope of the one before. */
            cell[i * 2 * BS_TABLES + 2 * k + 1] = (i < n ? table[i + 1] - table[i] : table[n] - table[n - 1])
                                                  / r->table.step_mm;
        }
    }
    return NULL;
}

static const char *bs_heads_(bs_resource *r, const double *head)
{
    bs_table *t = &r->table;
    size_t k;
    t->step_mm = head[0];
    t->end_mm = head[1];
    t->width_scale_max = head[2];
    r->reference_C = head[3];
    r->mm_per_stroke = head[4];
    r->force_per_kN = head[5];
    for (k = 0; k < BS_RANGE; ++k)
        r->range[k] = head[6 + k];
    for (k = 0; k < BS_PARAMETERS; ++k)
        r->parameter[k] = head[6 + BS_RANGE + k];
    for (k = 0; k < BS_FLAGS; ++k)
        r->flag[k] = head[6 + BS_RANGE + BS_PARAMETERS + k];
    for (k = 0; k < BS_HEAD; ++k)
        if (head[k] != head[k])
            return "holds a number that is none";
    if (!(t->step_mm > 0.0 && t->end_mm > 0.0 && t->end_mm <= BS_MOST && t->width_scale_max > 0.0
          && r->mm_per_stroke > 0.0 && r->mm_per_stroke <= 1e6 && r->force_per_kN > 0.0
          && r->force_per_kN <= 1e6 && fabs(r->reference_C) <= BS_MOST))
        return "holds a size that no spring has";
    t->per_step = 1.0 / t->step_mm;
    if ((size_t)(t->end_mm * t->per_step) > t->cells
        || fabs(t->end_mm * t->per_step - (double)t->cells) > 1e-6)
        return "does not end where its cells end";
    return NULL;
}

/* Read a file; NULL, or what is wrong with it. What was read is freed by bs_release(). */
static const char *bs_read_(bs_resource *r, FILE *file)
{
    unsigned char start[24];
    uint32_t mark, cells, crc;
    unsigned char *bytes;
    const char *wrong;
    size_t size;
    if (fread(start, 1, sizeof start, file) != sizeof start || memcmp(start, "BSSPRNG2", 8) != 0)
        return "is no table of a bufferstand spring (version 2)";
    memcpy(&mark, start + 8, 4);
    memcpy(&cells, start + 12, 4);
    memcpy(&crc, start + 16, 4);
    if (mark != 0x01020304u)
        return "was written for the other byte order";
    if (cells < 8 || cells > 2000000)
        return "holds an impossible number of cells";
    size = BS_GUID + (BS_HEAD + BS_TABLES * ((size_t)cells + 1)) * sizeof(double);
    bytes = malloc(size);
    r->cells = malloc(((size_t)cells + 1) * sizeof *r->cells);
    if (!bytes || !r->cells)
        wrong = "does not fit into memory";
    else if (fread(bytes, 1, size, file) != size || fgetc(file) != EOF)
        wrong = "is too short or too long for its cells";
    else if (bs_crc_(0, bytes, size) != crc)
        wrong = "is damaged (its checksum does not fit)";
    else {
        const double *numbers = (const double *)(const void *)(bytes + BS_GUID);
        memcpy(r->guid, bytes, BS_GUID);
        r->guid[BS_GUID - 1] = '\0';
        r->crc = crc;
        r->table.cells = cells;
        r->table.cell = r->cells;
        wrong = bs_heads_(r, numbers);
        if (!wrong)
            wrong = bs_lay_(r, numbers + BS_HEAD);
    }
    free(bytes);
    return wrong;
}

static void bs_release(bs_resource *r)
{
    free(r->cells);
    r->cells = NULL;
}

#endif
