/*
 * NOT a gate, but a test bench for single estimates, the C version of examples/estimate_bench.rs. They arrive over a
 * serial line, and each is evaluated by itself. An output is high after a permit and at no other time. There is no
 * sequence of permits, no second evaluation and no settings. For a gate see docking_gate.c.
 *
 *   make build/thumbv7em-none-eabihf/estimate_bench.elf
 *   qemu-system-arm -M mps2-an386 -display none -monitor none -serial stdio -kernel build/thumbv7em-none-eabihf/estimate_bench.elf
 *
 * crates/posegate-cli/tests/uart_replay.rs communicates with this program as with the Rust version.
 */
#include "board.h"
#include "posegate.h"
#include "tables.h"

#define TABLE_COUNT 2U
/* Older estimates are denied. */
#define MAXIMUM_AGE_MS 200U
/* A permit ends after this time without a request. */
#define LONGEST_SILENCE (TICKS_PER_SECOND / 1000U * MAXIMUM_AGE_MS)

static posegate_judge judges[TABLE_COUNT];
static posegate_receiver receiver;

/* Keeps the interlock closed until a reset. In a product the watchdog resets. */
static void halt(void)
{
    __asm__ volatile("cpsid i" : : : "memory");
    for (;;) {
        led_drive(false);
    }
}

void on_fault(void)
{
    halt();
}

/* Halts if the output does not follow: it cannot serve as an interlock. */
static void drive(bool high)
{
    led_drive(high);
    if (led_is_high() != high) {
        halt();
    }
}

/* Sets up one judge per table. A damaged table also gives a judge: it denies with the reason. */
static void init(void)
{
    drive(false);
    if (posegate_abi_version() != POSEGATE_ABI_VERSION) {
        halt();
    }
    if ((posegate_judge_init(&judges[0], table_dock, table_dock_length,
                             MAXIMUM_AGE_MS) != POSEGATE_STATUS_OK) ||
        (posegate_judge_init(&judges[1], table_see_t7, table_see_t7_length,
                             MAXIMUM_AGE_MS) != POSEGATE_STATUS_OK) ||
        (posegate_receiver_init(&receiver) != POSEGATE_STATUS_OK)) {
        halt();
    }
    uart_init();
    timer_init(LONGEST_SILENCE);
}

/* Evaluates a request and drives the interlock. An invalid request closes it. */
static posegate_status judged(posegate_status received, const posegate_message *body,
                              posegate_reply *reply)
{
    posegate_request request;
    posegate_status status = received;
    if (status == POSEGATE_STATUS_OK) {
        status = posegate_request_decode(body->bytes, body->length, &request);
    }
    if (status == POSEGATE_STATUS_OK) {
        status = posegate_request_judge(&request, judges, TABLE_COUNT, &reply->verdict);
    }
    if (status != POSEGATE_STATUS_OK) {
        drive(false);
        return status;
    }
    drive(reply->verdict.verdict == POSEGATE_PERMIT);
    reply->sequence = request.sequence;
    reply->interlock_high = led_is_high() ? 1U : 0U;
    return POSEGATE_STATUS_OK;
}

static void answer(posegate_status received, const posegate_message *body)
{
    static const posegate_reply refused = {.sequence = 0xffffU};
    posegate_reply reply = refused;
    posegate_message message;
    reply.status = judged(received, body, &reply);
    if ((posegate_reply_encode(&reply, &message) != POSEGATE_STATUS_OK) ||
        (posegate_frame_encode(&message, &message) != POSEGATE_STATUS_OK)) {
        halt();
    }
    uart_send(message.bytes, message.length);
}

int main(void)
{
    init();
    for (;;) {
        posegate_message body;
        posegate_status received = POSEGATE_STATUS_OK;
        int32_t byte = uart_receive();
        body.is_complete = 0U;
        if (byte >= 0) {
            received = posegate_receiver_push(&receiver, (uint8_t)byte, &body);
        }
        if (body.is_complete != 0U) {
            timer_restart();
            answer(received, &body);
        } else if (timer_has_run_out()) {
            drive(false);
        } else {
            /* Within a frame, or between two frames. */
        }
    }
}
