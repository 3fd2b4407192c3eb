/*
 * A motion controller with an interlock, as a product would use the gate: set-up once, a step with every
 * report, a tick in every cycle without one, and a pin that is high only while the permission permits.
 *
 * Reports of source 0 are evaluated at their arrival. Reports of source 1 are fixes of a slow source, which a tracker
 * carries along the odometry, so that the gate evaluates the pose of every cycle while the robot drives.
 *
 * The robot is simulated: a script of reports and of silence, with a synthetic clock and the expected
 * results. `./ci.sh c` runs it under QEMU.
 */
#include "board.h"
#include "posegate.h"
#include "task_digest.h"
#include "tables.h"

/* Constants in flash. The digest is that of the task that this firmware was built for. */
static const posegate_settings SETTINGS = {
    .task = "dock",
    .task_digest = TASK_DIGEST,
    .sources =
        {
            /* The robot's speed is the same for every source: 0.1 m/s ahead, 0.1 rad/s. None to the side: the pose is that of
               a point on the axle. */
            {.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
             .motion = POSEGATE_MOTION_MOVES, .along_m_s = 0.1, .across_m_s = 0.0, .turn_rad_s = 0.1},
            /* Carried: the tracker applies the trust. */
            {.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
             .motion = POSEGATE_MOTION_MOVES, .along_m_s = 0.1, .across_m_s = 0.0, .turn_rad_s = 0.1},
        },
    .source_count = 2U,
    .maximum_age_ms = 200U,
    /* The control period, a step and the output. */
    .response_ms = 60U,
    .report_period_ms = 50U,
    .permit_hold_ms = 100U,
    .inhibit_hold_ms = 500U,
    .permits_in_a_row = 3U,
    .restart = POSEGATE_RESTART_AUTOMATIC,
    .look_at_tag = 7U,
};

/* Wheels that slip by 2 % at most; deviations as measured for this robot. */
static const posegate_tracker_settings TRACKING = {
    .errors = {.m_per_sqrt_m = 0.005, .rad_per_sqrt_rad = 0.02, .rad_per_sqrt_m = 0.01,
               .slip = 0.02, .turn_slip = 0.02},
    /* Its frame is not used. */
    .source = {.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
               .motion = POSEGATE_MOTION_MOVES, .along_m_s = 0.1, .across_m_s = 0.0, .turn_rad_s = 0.1},
    .maximum_gap_ms = 60U,
    .maximum_fix_age_ms = 1000U,
};

static posegate_gate gate;
static posegate_tracker tracker;
/* The gate counts its calls here, so a restored copy of an old gate is detected by its different count. */
static uint32_t calls;
/* Wraps in the middle of the script. */
static uint32_t now_ms = 0xffffff00U;
/* When the odometry was last read. An increment begins there, also if a cycle was late: a gap would close the gate. */
static uint32_t reading_ms;
static uint32_t sequence;
static uint64_t frame_map;
/* For the script: simulates the read-back of a welded contact. */
static bool is_welded;

static void fail(const char *what)
{
    led_drive(false);
    print("FAILED: ");
    print(what);
    print("\n");
    stop(false);
}

void on_fault(void)
{
    fail("a fault of the processor");
}

static bool contact_is_closed(void)
{
    return is_welded || led_is_high();
}

/* Drives the output by the answer of a step. */
static void follow(posegate_status status, const posegate_step *step)
{
    /* After an error the step is a denial; the exact comparison with the permit byte is made anyway. */
    led_drive((status == POSEGATE_STATUS_OK) &&
              (posegate_permission_is_permit(&step->permission, now_ms) == POSEGATE_PERMIT));
    /* The contact does not follow: close permanently. A product allows it some milliseconds. */
    if (contact_is_closed() && !led_is_high()) {
        (void)posegate_gate_fault(&gate, POSEGATE_REASON_INTERLOCK_FAULT);
        led_drive(false);
    }
}

/* One control cycle: with a report, or with none (NULL). */
static posegate_step cycle(const posegate_report *report)
{
    posegate_step step;
    posegate_status status;
    if (report != NULL) {
        status = posegate_gate_step(&gate, now_ms, report, &step);
    } else {
        status = posegate_gate_tick(&gate, now_ms, &step);
    }
    follow(status, &step);
    return step;
}

/* One control cycle with an increment of the odometry. */
static posegate_step moving_cycle(const posegate_increment *increment)
{
    posegate_step step;
    posegate_status status;
    uint32_t broken;
    if ((posegate_tracker_odometry(&tracker, increment, &broken) != POSEGATE_STATUS_OK) ||
        (broken != 0U)) {
        status = posegate_gate_inhibit(&gate, now_ms, broken, &step);
    } else {
        /* Without a fix, or with one that is too old, the permit ends by itself. */
        status = posegate_gate_step_tracked(&gate, now_ms, &tracker, &step);
    }
    follow(status, &step);
    return step;
}

/* Returns a report of the localization: x, y, yaw, and covariance. */
static posegate_report report_at(float x_m)
{
    static const posegate_report empty = {0};
    posegate_compact compact = {.x_m = x_m, .xx = 1e-4F, .yy = 1e-4F, .yaw_yaw = 1e-4F};
    posegate_report report = empty;
    if (posegate_belief_from_compact(&compact, &report.belief) != POSEGATE_STATUS_OK) {
        fail("no belief");
    }
    report.frame = frame_map;
    report.source = 0U;
    report.sequence = sequence;
    report.stamp_ms = now_ms - 10U;
    sequence++;
    return report;
}

/* Checks the next line of the script, and prints it. */
static void expect(const char *what, const posegate_step *step, uint32_t kind, uint32_t reason)
{
    posegate_advice advice;
    bool open = kind == POSEGATE_STATE_KIND_PERMITTED;
    print(what);
    print(": ");
    print(open ? "open" : "closed");
    if (step->reason != 0U) {
        print(", ");
        print(posegate_reason_name(step->reason));
    }
    if ((posegate_gate_advice(&gate, &advice) == POSEGATE_STATUS_OK) &&
        (advice.kind == POSEGATE_ADVICE_KIND_LOOK_AT_TAG)) {
        print(", look at tag ");
        print_number(advice.tag);
    }
    print("\n");
    if ((step->state.kind != kind) || (step->reason != reason) || (led_is_high() != open)) {
        fail("not what the script expects");
    }
}

/* Sends good reports every 50 ms until the gate opens; returns their number. */
static uint32_t reports_until_open(void)
{
    for (uint32_t count = 1U; count <= 100U; count++) {
        posegate_report good = report_at(0.01F);
        posegate_step step = cycle(&good);
        if (led_is_high()) {
            expect("reports at the dock", &step, POSEGATE_STATE_KIND_PERMITTED, 0U);
            return count;
        }
        now_ms += 50U;
    }
    fail("the gate does not open");
    return 0U;
}

/* Drives at 25 mm/s for a number of cycles of 20 ms, ahead and back; returns the cycles in which the output was high. */
static uint32_t drive(uint32_t cycles, bool with_fixes, posegate_step *step)
{
    uint32_t high = 0U;
    for (uint32_t count = 0U; count < cycles; count++) {
        posegate_increment increment = {.ahead_m = ((count / 4U) % 2U == 0U) ? 0.0005 : -0.0005,
                                        .begins_ms = reading_ms,
                                        .stamp_ms = now_ms};
        /* A fix every half second, 80 ms old; the robot has not moved since then. */
        if (with_fixes && (count % 24U == 8U)) {
            uint32_t refused;
            posegate_report fix = report_at(0.0F);
            fix.source = 1U;
            fix.stamp_ms = now_ms - 80U;
            if ((posegate_tracker_fix(&tracker, &fix, &refused) != POSEGATE_STATUS_OK) ||
                (refused != 0U)) {
                fail("a fix is refused");
            }
        }
        reading_ms = now_ms;
        *step = moving_cycle(&increment);
        high += led_is_high() ? 1U : 0U;
        now_ms += 20U;
    }
    return high;
}

static void moving_script(void)
{
    posegate_step step;
    posegate_increment jump = {.ahead_m = 0.3};
    reading_ms = now_ms - 20U;
    /* The first fix comes in the ninth cycle; from then on each cycle has a report, and the hold time passes. */
    if (drive(100U, true, &step) < 60U) {
        fail("odometry does not keep the gate open");
    }
    expect("fixes twice a second, with odometry", &step, POSEGATE_STATE_KIND_PERMITTED, 0U);
    jump.begins_ms = reading_ms;
    jump.stamp_ms = now_ms;
    reading_ms = now_ms;
    step = moving_cycle(&jump);
    expect("the odometry jumps", &step, POSEGATE_STATE_KIND_INHIBITED,
           POSEGATE_REASON_ODOMETRY_JUMP);
    now_ms += 20U;
    (void)drive(100U, true, &step);
    expect("after a newer fix", &step, POSEGATE_STATE_KIND_PERMITTED, 0U);
    (void)drive(80U, false, &step);
    expect("the fixes end", &step, POSEGATE_STATE_KIND_INHIBITED, POSEGATE_REASON_SILENT);
}

static void script(void)
{
    posegate_report report;
    posegate_step step = cycle(NULL);
    expect("at the start", &step, POSEGATE_STATE_KIND_INHIBITED, POSEGATE_REASON_SILENT);

    /* The hold time after the start, 500 ms, is longer than three reports. */
    if (reports_until_open() != 11U) {
        fail("the gate does not open after its hold time");
    }

    for (uint32_t ms = 0U; ms <= 100U; ms += 10U) {
        step = cycle(NULL);
        now_ms += 10U;
    }
    expect("reports end, 100 ms", &step, POSEGATE_STATE_KIND_PERMITTED, 0U);
    step = cycle(NULL);
    expect("reports end, 110 ms", &step, POSEGATE_STATE_KIND_INHIBITED, POSEGATE_REASON_SILENT);

    (void)reports_until_open();
    now_ms += 50U;
    report = report_at(0.07F);
    step = cycle(&report);
    expect("beside the dock", &step, POSEGATE_STATE_KIND_INHIBITED, POSEGATE_REASON_NOT_CONTAINED);

    (void)reports_until_open();
    now_ms += 50U;
    report = report_at(0.01F);
    report.frame = 0U;
    step = cycle(&report);
    expect("a frame that nobody named", &step, POSEGATE_STATE_KIND_INHIBITED,
           POSEGATE_REASON_FRAME_MISMATCH);

    (void)reports_until_open();
    now_ms += 50U;
    report = report_at(0.01F);
    report.belief.spread_kind = 77U;
    if ((posegate_gate_step(&gate, now_ms, &report, &step) != POSEGATE_STATUS_BAD_VALUE) ||
        (posegate_permission_is_permit(&step.permission, now_ms) != POSEGATE_DENY)) {
        fail("a report of no kind is taken");
    }
    step = cycle(NULL);
    expect("a report of no kind", &step, POSEGATE_STATE_KIND_INHIBITED,
           POSEGATE_REASON_SOURCE_UNKNOWN);

    (void)reports_until_open();
    is_welded = true;
    now_ms += 50U;
    report = report_at(0.07F);
    step = cycle(&report);
    step = cycle(NULL);
    expect("the contact is welded", &step, POSEGATE_STATE_KIND_LATCHED,
           POSEGATE_REASON_INTERLOCK_FAULT);

    is_welded = false;
    if (posegate_gate_reset(&gate, now_ms) != POSEGATE_STATUS_OK) {
        fail("no reset");
    }
    (void)reports_until_open();
    now_ms += 20U;
    moving_script();
}

int main(void)
{
    /* Low before anything else. */
    led_drive(false);
    if (posegate_abi_version() != POSEGATE_ABI_VERSION) {
        fail("header and archive are of two versions");
    }
    if (posegate_frame_id("map", 3U, &frame_map) != POSEGATE_STATUS_OK) {
        fail("no frame");
    }
    /* A gate denies before it is set up. */
    {
        posegate_step step;
        if ((posegate_gate_tick(&gate, now_ms, &step) != POSEGATE_STATUS_NOT_INITIALISED) ||
            (posegate_permission_is_permit(&step.permission, now_ms) != POSEGATE_DENY)) {
            fail("zeroed memory is a gate");
        }
    }
    if (posegate_gate_init(&gate, table_dock, table_dock_length, &SETTINGS, &calls,
                           now_ms) != POSEGATE_STATUS_OK) {
        fail("a setting switches a check off");
    }
    if (posegate_tracker_init(&tracker, table_dock, table_dock_length, &TRACKING) !=
        POSEGATE_STATUS_OK) {
        fail("a setting of the tracker is invalid");
    }
    script();
    print("the controller did as its script says\n");
    led_drive(false);
    stop(true);
    return 0;
}
