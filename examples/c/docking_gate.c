/*
 * The smallest firmware with a gate, the C version of examples/docking_gate.rs: a table in flash, settings, a step or a
 * tick in every control cycle, and an output that is high only while the gate permits.
 *
 *   make run
 *
 * robot.c simulates the robot; `./ci.sh c` checks when the output opens and closes. controller.c shows more: a contact
 * with read-back, faults, resets and advice.
 */
#include "board.h"
#include "posegate.h"
#include "robot.h"
#include "task_digest.h"
#include "tables.h"

/* Constants in flash. The digest is that of the task: `posegate table info` prints it. */
static const posegate_settings SETTINGS = {
    .task = "dock",
    .task_digest = TASK_DIGEST,
    .sources = {{.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
                 .motion = POSEGATE_MOTION_STANDS_STILL}},
    .source_count = 1U,
    .maximum_age_ms = 200U,
    .response_ms = 20U, /* the control period, a step and the output */
    .report_period_ms = 50U,
    .permit_hold_ms = 100U,
    .inhibit_hold_ms = 500U,
    .permits_in_a_row = 3U,
    .restart = POSEGATE_RESTART_AUTOMATIC,
    .look_at_tag = 7U,
};

static posegate_gate gate; /* storage of the caller: nothing is allocated */
static uint32_t calls;     /* counted by the gate, so that a restored old copy is refused */

/* Keeps the output closed until a reset. In a product the watchdog resets. */
void on_fault(void)
{
    for (;;) {
        led_drive(false);
    }
}

int main(void)
{
    led_drive(false); /* before anything else; the program halts if the set-up fails */
    if ((posegate_abi_version() != POSEGATE_ABI_VERSION) ||
        (posegate_gate_init(&gate, table_dock, table_dock_length, &SETTINGS, &calls,
                            robot_now_ms()) != POSEGATE_STATUS_OK)) {
        on_fault();
    }
    while (robot_waits_for_its_next_cycle()) {
        posegate_report report;
        posegate_step step;
        const uint32_t now_ms = robot_now_ms(); /* one time for the whole cycle */
        (void)posegate_gate_scrub(&gate, 32U, NULL); /* latches a fault if it finds one */
        if (robot_report(&report)) {
            (void)posegate_gate_step(&gate, now_ms, &report, &step);
        } else {
            (void)posegate_gate_tick(&gate, now_ms, &step);
        }
        /* After an error the step is a denial: the output opens only for the exact permit byte. */
        led_drive(posegate_permission_is_permit(&step.permission, now_ms) == POSEGATE_PERMIT);
        robot_tell(&step, led_is_high());
    }
    led_drive(false);
    robot_stop();
    return 0;
}
