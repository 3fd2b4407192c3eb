/*
 * The smallest firmware with a gate, in C what examples/docking_gate.rs is in Rust: a table in flash, settings, a step or
 * a tick in every control cycle, and an output that is high only while the gate permits.
 *
 *   make run
 *
 * The robot is played by robot.c; `./ci.sh c` checks when the output opens and closes. controller.c has more: a contact
 * that is read back, faults, resets and advice.
 */
#include "board.h"
#include "posegate.h"
#include "robot.h"
#include "site_digest.h"
#include "tables.h"

/* Constants in flash. The digest is that of the site file: `posegate table info` prints it. */
static const posegate_settings SETTINGS = {
    .task = "dock",
    .site_digest = SITE_DIGEST,
    .sources = {{.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED}},
    .source_count = 1U,
    .maximum_age_ms = 200U,
    .response_ms = 20U, /* the control period, a step and the output */
    .permit_hold_ms = 100U,
    .inhibit_hold_ms = 500U,
    .permits_in_a_row = 3U,
    .restart = POSEGATE_RESTART_AUTOMATIC,
    .look_at_tag = 7U,
};

static posegate_gate gate; /* the caller's storage: nothing is allocated */
static uint32_t calls;     /* the gate counts in it, so that an old copy that is put back is refused */

/* Closed for good, until a reset. A product lets its watchdog do that. */
void on_fault(void)
{
    for (;;) {
        led_drive(false);
    }
}

int main(void)
{
    led_drive(false); /* before anything else; what cannot be set up is not run without */
    if ((posegate_abi_version() != POSEGATE_ABI_VERSION) ||
        (posegate_gate_init(&gate, table_dock, table_dock_length, &SETTINGS, &calls,
                            robot_now_ms()) != POSEGATE_STATUS_OK)) {
        on_fault();
    }
    while (robot_waits_for_its_next_cycle()) {
        posegate_report report;
        posegate_step step;
        const uint32_t now_ms = robot_now_ms(); /* one time for the whole cycle */
        (void)posegate_gate_scrub(&gate, 32U, NULL); /* latches a fault that it finds */
        if (robot_report(&report)) {
            (void)posegate_gate_step(&gate, now_ms, &report, &step);
        } else {
            (void)posegate_gate_tick(&gate, now_ms, &step);
        }
        /* After an error the step is a denial: the comparison with the one right byte is all that opens. */
        led_drive(posegate_permission_is_permit(&step.permission, now_ms) == POSEGATE_PERMIT);
        robot_tell(&step, led_is_high());
    }
    led_drive(false);
    robot_stop();
    return 0;
}
