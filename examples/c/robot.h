/*
 * A robot that is played, as examples/board/robot.rs plays it: the clock of its control cycles, the reports of its
 * localization, and a console that shows when the interlock changes. A product has its own in this place.
 */
#ifndef ROBOT_H
#define ROBOT_H

#include "posegate.h"
#include <stdbool.h>

/* A clock that nothing stops, the one that reports are stamped by. */
uint32_t robot_now_ms(void);
/* Waits for the next control cycle; false at the end of the script. */
bool robot_waits_for_its_next_cycle(void);
/* The report that has come since the last cycle, if any. */
bool robot_report(posegate_report *report);
/* Tells when the interlock changes, and why it closes. */
void robot_tell(const posegate_step *step, bool is_high);
void robot_stop(void);

#endif
