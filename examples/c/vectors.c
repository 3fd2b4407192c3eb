/*
 * Repeats the decisions of tests/data/vectors.bin through the C interface, the C version of examples/vectors.rs:
 * prints the same JSON line, and fails if a decision differs from the file.
 * crates/posegate-testkit/src/replay.rs describes the file.
 */
#include "board.h"
#include "posegate.h"
#include "tables.h"

#define TABLE_COUNT 8U
#define MAXIMUM_AGE_MS 200U
#define HEADER_LENGTH 12U
#define CRC_LENGTH 4U
#define WITH_REPLY 0x80U
#define REPLY_LENGTH 23U
/* A file with fewer decisions is refused: it would test too little. */
#define FEWEST 10000U

struct flash {
    const uint8_t *bytes;
    const uint32_t *length;
};

/* In the order of the table numbers in the requests. */
static const struct flash TABLES[TABLE_COUNT] = {
    {table_dock, &table_dock_length},
    {table_see_t7, &table_see_t7_length},
    {table_see_t7_grid, &table_see_t7_grid_length},
    {table_whole_circle, &table_whole_circle_length},
    {table_turning, &table_turning_length},
    {table_over_180, &table_over_180_length},
    {table_over_180_grid, &table_over_180_grid_length},
    {table_corner, &table_corner_length},
};

static posegate_judge judges[TABLE_COUNT];

/* The unread rest of the file. */
static const uint8_t *rest;
static const uint8_t *file_end;

static void fail(const char *fault)
{
    print("{\"error\":\"");
    print(fault);
    print("\"}\n");
    stop(false);
}

void on_fault(void)
{
    fail("fault");
}

static uint32_t word(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8) | ((uint32_t)bytes[2] << 16) |
           ((uint32_t)bytes[3] << 24);
}

static const uint8_t *take(size_t length)
{
    const uint8_t *part = rest;
    if ((size_t)(file_end - rest) < length) {
        fail("a record is cut");
    }
    rest += length;
    return part;
}

/* Checks the header and checksum of the file and returns the number of records. */
static uint32_t open_file(void)
{
    static const uint8_t magic[8] = {'P', 'G', 'V', 'E', 'C', 'T', 'O', 'R'};
    size_t content = (size_t)vector_file_length - CRC_LENGTH;
    uint32_t checksum = 0U;
    if ((posegate_checksum(0U, vector_file, content, &checksum) != POSEGATE_STATUS_OK) ||
        (checksum != word(vector_file + content))) {
        fail("the checksum does not hold");
    }
    for (size_t i = 0; i < sizeof magic; i++) {
        if (vector_file[i] != magic[i]) {
            fail("no vector file");
        }
    }
    rest = vector_file + HEADER_LENGTH;
    file_end = vector_file + content;
    return word(vector_file + 8);
}

/* Returns the decision alone, as in the file: 0 or a reason; 0xff if there is no decision. */
static uint32_t answer(const posegate_request *request)
{
    posegate_estimate estimate;
    posegate_verdict verdict;
    if (request->table >= TABLE_COUNT) {
        return 0xffU;
    }
    estimate.belief = request->belief;
    estimate.stamp_ms = request->stamp_ms;
    estimate.now_ms = request->now_ms;
    estimate.radius_squared_q16 = request->radius_squared_q16;
    estimate.reserved = 0U;
    if (posegate_judge_permits(&judges[request->table], &estimate, &verdict) !=
        POSEGATE_STATUS_OK) {
        return 0xffU;
    }
    if ((verdict.verdict == POSEGATE_PERMIT) == (verdict.reason != 0U)) {
        return 0xffU;
    }
    return verdict.reason;
}

/* Returns true if the reply to a request has these bytes. */
static bool replies(const posegate_request *request, const uint8_t *expected)
{
    static const posegate_reply none = {0};
    posegate_reply reply = none;
    posegate_message body;
    bool same;
    reply.sequence = request->sequence;
    reply.status = posegate_request_judge(request, judges, TABLE_COUNT, &reply.verdict);
    if (posegate_reply_encode(&reply, &body) != POSEGATE_STATUS_OK) {
        return false;
    }
    same = body.length == REPLY_LENGTH;
    for (size_t i = 0; i < REPLY_LENGTH; i++) {
        same = same && (body.bytes[i] == expected[i]);
    }
    return same;
}

/* Returns true if the next decision is that of the file. */
static bool holds(void)
{
    const uint8_t *head = take(2U);
    const uint8_t *bytes = take(head[1]);
    posegate_request request;
    bool same;
    if (posegate_request_decode(bytes, head[1], &request) != POSEGATE_STATUS_OK) {
        fail("a record holds no request");
    }
    same = answer(&request) == (uint32_t)(head[0] & ~WITH_REPLY);
    if ((head[0] & WITH_REPLY) != 0U) {
        const uint8_t *reply = take(REPLY_LENGTH);
        same = replies(&request, reply) && same;
    }
    return same;
}

int main(void)
{
    uint32_t count;
    uint32_t mismatches = 0U;
    uint32_t first_mismatch = 0U;
    for (size_t i = 0; i < TABLE_COUNT; i++) {
        if (posegate_judge_init(&judges[i], TABLES[i].bytes, *TABLES[i].length, MAXIMUM_AGE_MS) !=
            POSEGATE_STATUS_OK) {
            fail("a judge does not take its maximum age");
        }
    }
    count = open_file();
    for (uint32_t index = 0; index < count; index++) {
        if (!holds()) {
            if (mismatches == 0U) {
                first_mismatch = index;
            }
            mismatches++;
        }
    }
    if (rest != file_end) {
        fail("bytes after the last record");
    }
    print("{\"name\":\"vectors ");
    print(core_name());
    print("\",\"count\":");
    print_number(count);
    print(",\"mismatches\":");
    print_number(mismatches);
    print(",\"first_mismatch\":");
    if (mismatches == 0U) {
        print("null");
    } else {
        print_number(first_mismatch);
    }
    print(",\"goal\":0}\n");
    stop((count >= FEWEST) && (mismatches == 0U));
    return 0;
}
