/*
 * A motion controller with an interlock, as a product would use the gate: set-up once, a step with every
 * report, a tick in every cycle without one, and a pin that is high only while the permission permits.
 *
 * The robot is simulated: a script of reports and of silence, with a synthetic clock and the expected
 * results. `./ci.sh c` runs it under QEMU.
 */
#include "board.h"
#include "posegate.h"
#include "site_digest.h"
#include "tables.h"

/* Constants in flash. The digest is that of the site file that this firmware was built for. */
static const posegate_settings SETTINGS = {
    .task = "dock",
    .site_digest = SITE_DIGEST,
    .sources =
        {
            {.frame = "map", .inflation = 1.0, .cross_terms = POSEGATE_CROSS_TERMS_FILLED,
             .motion = POSEGATE_MOTION_STANDS_STILL},
        },
    .source_count = 1U,
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

static posegate_gate gate;
/* The gate counts its calls here, so a restored copy of an old gate is detected by its different count. */
static uint32_t calls;
/* Wraps in the middle of the script. */
static uint32_t now_ms = 0xffffff00U;
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
    /* After an error the step is a denial; the exact comparison with the permit byte is made anyway. */
    led_drive((status == POSEGATE_STATUS_OK) &&
              (posegate_permission_is_permit(&step.permission, now_ms) == POSEGATE_PERMIT));
    /* The contact does not follow: close permanently. A product allows it some milliseconds. */
    if (contact_is_closed() && !led_is_high()) {
        (void)posegate_gate_fault(&gate, POSEGATE_REASON_INTERLOCK_FAULT);
        led_drive(false);
    }
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
    script();
    print("the controller did as its script says\n");
    led_drive(false);
    stop(true);
    return 0;
}
