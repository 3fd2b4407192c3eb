#include "robot.h"
#include "board.h"

#define CYCLE_MS 10U
#define REPORT_MS 50U
/* Age of an estimate when it arrives. */
#define AGE_MS 10U
/*
 * First there are no reports. Then the robot is at the dock, then next to it, then at the dock again; then the reports
 * end.
 */
#define FIRST_MS 100U
#define BESIDE_FROM_MS 1500U
#define BESIDE_TO_MS 1600U
#define LAST_MS 3000U
#define END_MS 3300U

static uint32_t now_ms;
static uint32_t sequence;
static bool was_high;

uint32_t robot_now_ms(void)
{
    return now_ms;
}

bool robot_waits_for_its_next_cycle(void)
{
    now_ms += CYCLE_MS;
    return now_ms <= END_MS;
}

bool robot_report(posegate_report *report)
{
    static const posegate_report empty = {0};
    bool is_beside = (now_ms >= BESIDE_FROM_MS) && (now_ms < BESIDE_TO_MS);
    posegate_compact compact = {
        .x_m = is_beside ? 0.07F : 0.01F, .xx = 1e-4F, .yy = 1e-4F, .yaw_yaw = 1e-4F};
    *report = empty;
    if ((now_ms < FIRST_MS) || (now_ms > LAST_MS) || ((now_ms % REPORT_MS) != 0U)) {
        return false;
    }
    if ((posegate_belief_from_compact(&compact, &report->belief) != POSEGATE_STATUS_OK) ||
        (posegate_frame_id("map", 3U, &report->frame) != POSEGATE_STATUS_OK)) {
        stop(false);
    }
    report->source = 0U;
    report->sequence = sequence;
    report->stamp_ms = now_ms - AGE_MS;
    sequence++;
    return true;
}

void robot_tell(const posegate_step *step, bool is_high)
{
    if (is_high == was_high) {
        return;
    }
    was_high = is_high;
    print_number(now_ms);
    print(is_high ? " ms: open" : " ms: closed");
    if (step->reason != 0U) {
        print(", ");
        print(posegate_reason_name(step->reason));
    }
    print("\n");
}

void robot_stop(void)
{
    print_number(sequence);
    print(" reports\n");
    stop(true);
}
