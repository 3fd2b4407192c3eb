/* The bytes that tables.S places in flash. */
#ifndef TABLES_H
#define TABLES_H

#include <stdint.h>

extern const uint8_t table_dock[];
extern const uint32_t table_dock_length;
extern const uint8_t table_see_t7[];
extern const uint32_t table_see_t7_length;
extern const uint8_t table_see_t7_grid[];
extern const uint32_t table_see_t7_grid_length;
extern const uint8_t table_whole_circle[];
extern const uint32_t table_whole_circle_length;
extern const uint8_t table_turning[];
extern const uint32_t table_turning_length;
extern const uint8_t table_over_180[];
extern const uint32_t table_over_180_length;
extern const uint8_t table_over_180_grid[];
extern const uint32_t table_over_180_grid_length;
extern const uint8_t table_corner[];
extern const uint32_t table_corner_length;
extern const uint8_t vector_file[];
extern const uint32_t vector_file_length;

#endif
