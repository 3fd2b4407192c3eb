/*
 * A simulated robot, the C version of examples/board/robot.rs: the clock of its control cycles, the reports of its
 * localization, and a console that shows when the interlock changes. A product has its own code instead.
 */
#ifndef ROBOT_H
#define ROBOT_H

#include "posegate.h"
#include <stdbool.h>

/* Returns the time of the clock that stamps the reports; nothing stops it. */
uint32_t robot_now_ms(void);
/* Waits for the next control cycle; returns false at the end of the script. */
bool robot_waits_for_its_next_cycle(void);
/* Gets the report that has arrived since the last cycle; returns false if there is none. */
bool robot_report(posegate_report *report);
/* Prints when the interlock changes, and why it closes. */
void robot_tell(const posegate_step *step, bool is_high);
void robot_stop(void);

#endif
