// The firmware's own core as WebAssembly, with the functions and structs of include/posegate.h. Offsets are those of a
// 32-bit machine.
"use strict";

const SIZE = { judge: 208, estimate: 144, verdict: 24, request: 152, message: 156, reply: 36, info: 104 };
const PERMIT = 0xa5;
const OK = 0;

class Core {
  static async of(bytes) {
    const made = await WebAssembly.instantiate(bytes, {});
    return new Core(made.instance.exports);
  }

  constructor(exports) {
    this.exports = exports;
    this.memory = exports.memory;
    this.end = exports.__heap_base.value;
    this.estimate = this.allocate(SIZE.estimate);
    this.verdict = this.allocate(SIZE.verdict);
    this.request = this.allocate(SIZE.request);
    this.message = this.allocate(SIZE.message);
    this.reply = this.allocate(SIZE.reply);
    this.info = this.allocate(SIZE.info);
  }

  // Allocates memory in the core that is never freed.
  allocate(length) {
    const at = (this.end + 15) & ~15;
    this.end = at + length;
    const lacking = this.end - this.memory.buffer.byteLength;
    if (lacking > 0) this.memory.grow(Math.ceil(lacking / 65536));
    return at;
  }

  get view() {
    return new DataView(this.memory.buffer);
  }

  bytes(at, length) {
    return new Uint8Array(this.memory.buffer, at, length);
  }

  text(at) {
    const all = new Uint8Array(this.memory.buffer);
    let end = at;
    while (end < all.length && all[end] !== 0) end += 1;
    return new TextDecoder().decode(all.subarray(at, end));
  }

  put(bytes) {
    const at = this.allocate(bytes.length);
    this.bytes(at, bytes.length).set(bytes);
    return { at, length: bytes.length };
  }

  // Creates the judges of tables, contiguous in memory.
  judges(tables, maximumAge) {
    const first = this.allocate(SIZE.judge * tables.length);
    tables.forEach((table, number) => {
      const { at, length } = this.put(table);
      const judge = first + SIZE.judge * number;
      const status = this.exports.posegate_judge_init(judge, at, length, maximumAge);
      if (status !== OK) throw new Error(`a judge is refused: ${status}`);
    });
    return first;
  }

  // Creates a table's judge. Returns it with the squared radius of its confidence.
  judge(table) {
    const { at, length } = this.put(table);
    const judge = this.allocate(SIZE.judge);
    this.exports.posegate_judge_init(judge, at, length, 1000);
    const status = this.exports.posegate_table_check(at, length, this.info);
    const radiusSquared = status === OK ? this.view.getUint32(this.info + 88, true) / 65536 : 0;
    return { judge, status, radiusSquared };
  }

  // Returns the core's answer on an estimate in the world frame, metres and radians. `spread` is
  // `{ covariance: [9] }` or `{ translation, yaw }`.
  examine(judge, [x, y, yaw], spread) {
    const view = this.view;
    this.bytes(this.estimate, SIZE.estimate).fill(0);
    view.setFloat64(this.estimate, x, true);
    view.setFloat64(this.estimate + 8, y, true);
    view.setFloat64(this.estimate + 16, yaw, true);
    const numbers = spread.covariance ?? [spread.translation, spread.yaw];
    numbers.forEach((number, index) => view.setFloat64(this.estimate + 48 + 8 * index, number, true));
    view.setUint32(this.estimate + 120, 1, true);
    view.setUint32(this.estimate + 124, spread.covariance ? 1 : 2, true);
    const status = this.exports.posegate_judge_examine(judge, this.estimate, this.verdict);
    return { status, ...this.lastVerdict() };
  }

  lastVerdict() {
    const view = this.view;
    const at = this.verdict;
    const reason = view.getUint32(at + 4, true);
    const worst = [
      view.getInt32(at + 12, true) / 1e6,
      view.getInt32(at + 16, true) / 1e6,
      (view.getUint32(at + 20, true) / 4294967296) * 2 * Math.PI,
    ];
    return {
      permit: view.getUint8(at) === PERMIT,
      reason,
      marginQ16: view.getUint8(at + 1) ? view.getUint32(at + 8, true) : null,
      worst: view.getUint8(at + 2) ? worst : null,
    };
  }

  reason(code) {
    const name = this.exports.posegate_reason_name(code);
    const meaning = this.exports.posegate_reason_meaning(code);
    return { name: name ? this.text(name) : "", meaning: meaning ? this.text(meaning) : "" };
  }

  // Repeats the decisions of a vector file. Returns the number of decisions that differ from it.
  replay(file, tables) {
    const judges = this.judges(tables, 200);
    const { at, length } = this.put(file);
    const view = new DataView(file.buffer, file.byteOffset, file.length);
    const end = length - 4;
    if (this.exports.posegate_checksum(0, at, end, this.info) !== OK) throw new Error("no checksum");
    if (this.view.getUint32(this.info, true) !== view.getUint32(end, true)) {
      throw new Error("the checksum does not hold");
    }
    const count = view.getUint32(8, true);
    let [place, mismatches] = [12, 0];
    for (let index = 0; index < count; index += 1) {
      const [head, size] = [file[place], file[place + 1]];
      place += 2;
      if (this.exports.posegate_request_decode(at + place, size, this.request) !== OK) {
        throw new Error(`record ${index} holds no request`);
      }
      place += size;
      let same = this.answer(judges, tables.length) === (head & 0x7f);
      if (head & 0x80) {
        same = this.replies(judges, tables.length, file.subarray(place, place + 23)) && same;
        place += 23;
      }
      if (!same) mismatches += 1;
    }
    if (place !== end) throw new Error("bytes after the last record");
    return { count, mismatches };
  }

  answer(judges, count) {
    const view = this.view;
    const table = view.getUint32(this.request + 132, true);
    if (table >= count) return 0xff;
    const belief = this.bytes(this.request, 128);
    this.bytes(this.estimate, 128).set(belief);
    view.setUint32(this.estimate + 128, view.getUint32(this.request + 136, true), true);
    view.setUint32(this.estimate + 132, view.getUint32(this.request + 140, true), true);
    view.setUint32(this.estimate + 136, view.getUint32(this.request + 144, true), true);
    view.setUint32(this.estimate + 140, 0, true);
    const judge = judges + SIZE.judge * table;
    if (this.exports.posegate_judge_permits(judge, this.estimate, this.verdict) !== OK) return 0xff;
    const { permit, reason } = this.lastVerdict();
    return permit === (reason !== 0) ? 0xff : reason;
  }

  replies(judges, count, expected) {
    const view = this.view;
    this.bytes(this.reply, SIZE.reply).fill(0);
    view.setUint32(this.reply, view.getUint32(this.request + 128, true), true);
    const status = this.exports.posegate_request_judge(this.request, judges, count, this.reply + 8);
    view.setInt32(this.reply + 4, status, true);
    if (this.exports.posegate_reply_encode(this.reply, this.message) !== OK) return false;
    if (view.getUint8(this.message + 3) !== expected.length) return false;
    const bytes = this.bytes(this.message + 4, expected.length);
    return expected.every((byte, index) => byte === bytes[index]);
  }
}
