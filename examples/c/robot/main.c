/*
 * The whole program of a robot: three tasks, odometry at 100 Hz, fixes twice a second that are 120 ms old, a gate and a tracker.
 * The robot drives into its dock. `./ci.sh robot` builds it with the archive as released, runs it under QEMU and prints what the
 * program costs: instructions of each call and of a whole cycle, stack, memory and flash.
 *
 * With -DEMPTY_LOOP it is the same program without the gate, so that the difference is what the gate takes.
 */
#include "../board.h"
#include "measure.h"
#ifndef EMPTY_LOOP
#include "posegate.h"
#include "task_digests.h"

#define CYCLE_MS 10U
#define CYCLES 1000U
#define FIX_EVERY 50U
#define FIX_AGE_MS 120U

extern const uint8_t table_dock[];
extern const uint32_t table_dock_length;
extern const uint8_t table_see_t7[];
extern const uint32_t table_see_t7_length;
extern const uint8_t table_wait[];
extern const uint32_t table_wait_length;

/* The gate evaluates what the tracker carries: the tracker applies the trust in the fixes. */
#define SETTINGS_OF(name, digest)                                                                          \
    {.task = name,                                                                                 \
     .task_digest = digest,                                                                   \
     .sources = {{.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,    \
                  .motion = POSEGATE_MOTION_MOVES, .along_m_s = 0.1, .across_m_s = 0.0,            \
                  .turn_rad_s = 0.1}},                                                             \
     .source_count = 1U,                                                                           \
     .maximum_age_ms = 60U,                                                                        \
     .response_ms = 20U,                                                                           \
     .report_period_ms = 10U,                                                                      \
     .permit_hold_ms = 30U,                                                                        \
     .inhibit_hold_ms = 200U,                                                                      \
     .permits_in_a_row = 3U,                                                                       \
     .restart = POSEGATE_RESTART_AUTOMATIC,                                                        \
     .look_at_tag = 7U}

static const posegate_settings SETTINGS[3] = {
    SETTINGS_OF("dock", TASK_DIGEST_OF_DOCK), SETTINGS_OF("see-t7", TASK_DIGEST_OF_SEE_T7),
    SETTINGS_OF("wait", TASK_DIGEST_OF_WAIT)};

static const posegate_tracker_settings TRACKING = {
    .errors = {.m_per_sqrt_m = 0.002, .rad_per_sqrt_rad = 0.01, .rad_per_sqrt_m = 0.005,
               .slip = 0.01, .turn_slip = 0.01},
    .source = {.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
               .motion = POSEGATE_MOTION_MOVES, .along_m_s = 0.1, .across_m_s = 0.0, .turn_rad_s = 0.1},
    .maximum_gap_ms = 30U,
    .maximum_fix_age_ms = 1500U,
};

static posegate_gate gate;
static posegate_tracker tracker;
static uint32_t calls;
static uint32_t now_ms = 0xffffff00U;
static uint32_t odometry_ms;
static uint32_t sequence;
static uint64_t frame_map;
/* Ahead of the dock's goal, metres; negative on the way to it. */
static double x_m = -0.3;

/* The instructions of a call: the sum over its calls and the most of one. */
struct cost {
    const char *name;
    uint64_t sum;
    uint32_t most;
    uint32_t count;
};

static struct cost of_init = {.name = "init"};
static struct cost of_change = {.name = "change of table"};
static struct cost of_odometry = {.name = "odometry"};
static struct cost of_fix = {.name = "fix"};
static struct cost of_late_fix = {.name = "fix that is 62 increments old"};
static struct cost of_step = {.name = "step on the tracker"};
static struct cost of_permission = {.name = "permission"};
static struct cost of_cycle = {.name = "cycle without a fix"};
static struct cost of_fix_cycle = {.name = "cycle with a fix"};

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

static void add(struct cost *cost, uint32_t instructions)
{
    cost->sum += instructions;
    cost->count++;
    if (instructions > cost->most) {
        cost->most = instructions;
    }
}

/* Counts the instructions of one call. */
#define COUNT(cost, total, call)                                                                   \
    do {                                                                                           \
        uint32_t taken;                                                                            \
        counter_start();                                                                           \
        call;                                                                                      \
        taken = counter_instructions();                                                            \
        add(&(cost), taken);                                                                       \
        (total) += taken;                                                                          \
    } while (false)

static void arm(uint32_t task, struct cost *cost)
{
    static const uint8_t *const tables[3] = {table_dock, table_see_t7, table_wait};
    const uint32_t lengths[3] = {table_dock_length, table_see_t7_length, table_wait_length};
    posegate_status status;
    uint32_t total = 0U;
    if (cost == &of_init) {
        COUNT(*cost, total, status = posegate_gate_init(&gate, tables[task], lengths[task], &SETTINGS[task], &calls, now_ms));
    } else {
        COUNT(*cost, total, status = posegate_gate_change_table(&gate, tables[task], lengths[task], &SETTINGS[task], now_ms));
    }
    if (status != POSEGATE_STATUS_OK) {
        fail("a setting switches a check off");
    }
}

/* A fix of the localization as it was then: the robot has moved since. */
static posegate_report fix_of_map(uint32_t age_ms, double moved_m)
{
    static const posegate_report empty = {0};
    posegate_compact compact = {.x_m = (float)(x_m - moved_m), .xx = 2e-5F, .yy = 1.5e-5F, .yaw_yaw = 1e-4F, .xy = 1e-6F};
    posegate_report report = empty;
    if (posegate_belief_from_compact(&compact, &report.belief) != POSEGATE_STATUS_OK) {
        fail("no belief");
    }
    report.frame = frame_map;
    report.sequence = sequence;
    report.stamp_ms = now_ms - age_ms;
    sequence++;
    return report;
}

/* One control cycle. Returns true if the interlock opens. */
static bool cycle(uint32_t number)
{
    bool drives = x_m < 0.0;
    posegate_increment increment = {.ahead_m = drives ? 0.0003 : 0.0, .begins_ms = odometry_ms, .stamp_ms = now_ms};
    posegate_step step;
    posegate_status status;
    uint32_t broken;
    uint32_t total = 0U;
    uint32_t permits = POSEGATE_DENY;
    bool with_fix = number % FIX_EVERY == 20U;
    x_m += increment.ahead_m;
    odometry_ms = now_ms;
    COUNT(of_odometry, total, status = posegate_tracker_odometry(&tracker, &increment, &broken));
    if (with_fix) {
        uint32_t refused = 0U;
        posegate_report fix = fix_of_map(FIX_AGE_MS, drives ? 0.0003 * (FIX_AGE_MS / CYCLE_MS) : 0.0);
        COUNT(of_fix, total, status = posegate_tracker_fix(&tracker, &fix, &refused));
        if ((status != POSEGATE_STATUS_OK) || (refused != 0U)) {
            fail("a fix is refused");
        }
    }
    if ((status != POSEGATE_STATUS_OK) || (broken != 0U)) {
        status = posegate_gate_inhibit(&gate, now_ms, broken, &step);
    } else {
        COUNT(of_step, total, status = posegate_gate_step_tracked(&gate, now_ms, &tracker, &step));
    }
    if (status == POSEGATE_STATUS_OK) {
        COUNT(of_permission, total, permits = posegate_permission_is_permit(&step.permission, now_ms));
    }
    led_drive(permits == POSEGATE_PERMIT);
    add(with_fix ? &of_fix_cycle : &of_cycle, total);
    return permits == POSEGATE_PERMIT;
}

static void line(const char *what, const char *name, uint32_t value, const char *unit)
{
    print("{\"name\":\"");
    print(name);
    print(what);
    print("\",\"value\":");
    print_number(value);
    print(",\"unit\":\"");
    print(unit);
    print("\",\"goal\":null}\n");
}

static void told(const struct cost *cost)
{
    if (cost->count > 1U) {
        line(", mean", cost->name, (uint32_t)(cost->sum / cost->count), "instructions");
    }
    line(", most", cost->name, cost->most, "instructions");
}

static void program(uint32_t *open, uint32_t *first_open)
{
    arm(0U, &of_init);
    for (uint32_t task = 1U; task < 3U; task++) {
        arm(task, &of_change);
    }
    arm(0U, &of_change);
    if (posegate_tracker_init(&tracker, table_dock, table_dock_length, &TRACKING) != POSEGATE_STATUS_OK) {
        fail("a setting of the tracker is invalid");
    }
    odometry_ms = now_ms;
    now_ms += CYCLE_MS;
    for (uint32_t number = 0U; number < CYCLES; number++) {
        if (cycle(number)) {
            if (*open == 0U) {
                *first_open = number;
            }
            (*open)++;
        }
        now_ms += CYCLE_MS;
    }
    /* The robot stands; then a fix comes for nearly all increments that are kept. */
    for (uint32_t number = 0U; number < 64U; number++) {
        posegate_increment increment = {.begins_ms = odometry_ms, .stamp_ms = now_ms};
        uint32_t broken;
        odometry_ms = now_ms;
        if ((posegate_tracker_odometry(&tracker, &increment, &broken) != POSEGATE_STATUS_OK) || (broken != 0U)) {
            fail("an increment is refused");
        }
        now_ms += CYCLE_MS;
    }
    now_ms -= CYCLE_MS;
    {
        uint32_t refused = 0U;
        uint32_t total = 0U;
        posegate_status status;
        posegate_report fix = fix_of_map(62U * CYCLE_MS, 0.0);
        COUNT(of_late_fix, total, status = posegate_tracker_fix(&tracker, &fix, &refused));
        if ((status != POSEGATE_STATUS_OK) || (refused != 0U)) {
            fail("a late fix is refused");
        }
    }
}

int main(void)
{
    const struct cost *const costs[] = {&of_init, &of_change, &of_odometry, &of_fix, &of_late_fix,
                                        &of_step, &of_permission, &of_cycle, &of_fix_cycle};
    uint32_t open = 0U;
    uint32_t first_open = 0U;
    uint32_t stack;
    led_drive(false);
    counter_init();
    if (posegate_frame_id("map", 3U, &frame_map) != POSEGATE_STATUS_OK) {
        fail("no frame");
    }
    stack_paint();
    program(&open, &first_open);
    stack = stack_used();
    for (size_t i = 0; i < sizeof costs / sizeof costs[0]; i++) {
        told(costs[i]);
    }
    line("", "stack of the program", stack, "B");
    line("", "memory of gate and tracker", (uint32_t)(sizeof gate + sizeof tracker), "B");
    line("", "cycles with an open interlock", open, "cycles");
    line("", "first cycle with an open interlock", first_open, "cycle");
    stop(open > 0U);
    return 0;
}
#else
void on_fault(void)
{
}

int main(void)
{
    for (;;) {
        led_drive(false);
    }
    return 0;
}
#endif
