//! The deepest stack of functions, from the instructions of a program that is linked: no run can need more.

use crate::shell::Result;
use std::collections::BTreeMap;

/// A function: what it takes itself, and the functions that it calls or continues in.
#[derive(Default)]
struct Function {
    frame: u64,
    calls: Vec<String>,
    /// The first instruction whose use of the stack is not understood.
    unknown: Option<String>,
    /// The register that has an address below the frame pointer, to which a function returns the stack at its end.
    restored: String,
    /// The register that was loaded last with a constant, and the constant.
    loaded: (String, i32),
}

/// The functions of a program.
pub struct Program(BTreeMap<String, Function>);

impl Program {
    /// Reads what `objdump -d --no-show-raw-insn` prints of a program for Arm or RISC-V.
    pub fn of(disassembly: &str) -> Self {
        let mut all: BTreeMap<String, Function> = BTreeMap::new();
        let mut name = String::new();
        // Constants in the code, by their addresses.
        let constants: BTreeMap<&str, u32> = disassembly
            .lines()
            .filter_map(|line| line.split_once(":\t.word\t0x"))
            .filter_map(|(at, word)| {
                let word = word.split_whitespace().next()?;
                Some((at.trim(), u32::from_str_radix(word, 16).ok()?))
            })
            .collect();
        for line in disassembly.lines() {
            if let Some(label) = label(line) {
                name = label.to_owned();
                all.entry(name.clone()).or_default();
            } else if let (Some(function), Some((_, instruction))) =
                (all.get_mut(&name), line.split_once(":\t"))
            {
                function.read(&name, instruction, &constants);
            }
        }
        Self(all)
    }

    /// Returns the most bytes of stack that a function and all that it calls take.
    ///
    /// # Errors
    /// The function is missing, or one below it calls itself, calls through a pointer, or moves the stack in another way.
    pub fn deepest(&self, name: &str) -> Result<u64> {
        self.below(name, &mut Vec::new())
    }

    fn below<'a>(&'a self, name: &'a str, path: &mut Vec<&'a str>) -> Result<u64> {
        let function = self
            .0
            .get(name)
            .ok_or_else(|| format!("no function {name} in the program"))?;
        if path.contains(&name) {
            return Err(format!("{} calls itself", path.join(" > ")).into());
        }
        if let Some(instruction) = &function.unknown {
            return Err(format!("{name}: the stack after `{instruction}` is not known").into());
        }
        path.push(name);
        let mut most = 0;
        for call in &function.calls {
            most = most.max(self.below(call, path)?);
        }
        path.pop();
        Ok(function.frame + most)
    }
}

/// Returns the name of a line as `00000400 <name>:`.
fn label(line: &str) -> Option<&str> {
    let (_, rest) = line.strip_suffix(">:")?.split_once(" <")?;
    Some(rest)
}

impl Function {
    fn read(&mut self, own: &str, instruction: &str, constants: &BTreeMap<&str, u32>) {
        let mut words = instruction
            .split([';', '@'])
            .next()
            .unwrap_or("")
            .trim()
            .split('\t');
        let operation = words.next().unwrap_or("").trim_end_matches(".w");
        let operands = words.next().unwrap_or("").trim();
        if let Some((register, "r7")) = operands
            .split_once(", ")
            .map(|(to, from)| (to, from.split(',').next().unwrap_or("")))
            && operation == "subs"
        {
            self.restored = register.to_owned();
        }
        if operation == "ldr"
            && let Some((register, _)) = operands.split_once(", [pc")
            && let Some((_, at)) = instruction.rsplit_once('(')
            && let Some(constant) = constants.get(at.split(' ').next().unwrap_or(""))
        {
            self.loaded = (register.to_owned(), *constant as i32);
        }
        let (register, constant) = &self.loaded;
        if operation == "add" && operands == format!("sp, {register}") {
            self.frame += u64::from(constant.min(&0).unsigned_abs());
            return;
        }
        let restores = operation == "mov" && operands == format!("sp, {}", self.restored);
        if let Some(bytes) = taken(operation, operands).filter(|_| !restores) {
            match bytes {
                Some(bytes) => self.frame += bytes,
                None => self.unknown = Some(instruction.to_owned()),
            }
            return;
        }
        // A call, or a jump: to a function, or through a register.
        let target = operands
            .rsplit_once(" <")
            .and_then(|(_, name)| name.strip_suffix('>'));
        let calls = matches!(operation, "bl" | "blx" | "jal" | "jalr");
        let returns = operation == "bx" && operands == "lr";
        if target.is_none() && !returns && (calls || matches!(operation, "bx" | "jr")) {
            self.unknown = Some(instruction.to_owned());
        }
        let jumps = operation.starts_with(['b', 'j']) || operation.starts_with("cb");
        let Some(target) = target.filter(|_| jumps) else {
            return;
        };
        // To the middle of a function go jumps within it, and the bytes that fill the space between two functions.
        if target.contains('+') {
            return;
        }
        if (calls || target != own) && !self.calls.iter().any(|call| call == target) {
            self.calls.push(target.to_owned());
        }
    }
}

/// Returns the bytes that an instruction takes from the stack, `Some(None)` if they are not in it, and `None` for other instructions.
fn taken(operation: &str, operands: &str) -> Option<Option<u64>> {
    let registers = || {
        let (_, list) = operands.split_once('{')?;
        list.trim_end_matches('}')
            .split(',')
            .map(count)
            .sum::<Option<u64>>()
    };
    let number = |text: &str| text.trim().trim_start_matches('#').parse::<i64>().ok();
    match operation {
        "push" => Some(registers().map(|count| 4 * count)),
        "stmdb" if operands.starts_with("sp!") => Some(registers().map(|count| 4 * count)),
        "vpush" => Some(registers().map(|count| 8 * count)),
        "sub" | "subw" if operands.starts_with("sp") => {
            let last = operands.rsplit(',').next()?;
            Some(number(last).and_then(|bytes| u64::try_from(bytes).ok()))
        }
        "str" | "strd" if operands.contains("[sp, #-") && operands.ends_with('!') => {
            let (_, by) = operands.split_once("[sp, #-")?;
            Some(by.trim_end_matches("]!").parse().ok())
        }
        "addi" | "add" if operands.starts_with("sp,") => {
            let last = operands.rsplit(',').next()?;
            match number(last) {
                Some(bytes) => (bytes < 0).then(|| Some(bytes.unsigned_abs())),
                None => Some(None),
            }
        }
        "mov" if operands.starts_with("sp,") => Some(None),
        _ => None,
    }
}

/// Returns how many registers a part of a list as `r4-r7` has.
fn count(part: &str) -> Option<u64> {
    let Some((from, to)) = part.split_once('-') else {
        return Some(1);
    };
    let number = |name: &str| {
        name.trim()
            .trim_start_matches(['r', 'd', 's'])
            .parse::<u64>()
            .ok()
    };
    number(to)?.checked_sub(number(from)?).map(|more| more + 1)
}

#[cfg(test)]
mod tests {
    use super::Program;

    const ARM: &str = "\n00000000 <step>:\n   0:\tstmdb\tsp!, {r4, r5, r6, lr}\n   4:\tvpush\t{d8-d9}\n   8:\tsub.w\tsp, sp, #1024\t@ 0x400\n   c:\tbl\t20 <decide>\n  10:\tb.n\t12 <step+0x12>\n\
        \n00000020 <decide>:\n  20:\tpush\t{r4, lr}\n  22:\tsub\tsp, #8\n  24:\tb.w\t30 <end>\n\n00000030 <end>:\n  30:\tstr.w\tlr, [sp, #-4]!\n  34:\tldr.w\tpc, [sp], #4\n\
        \n00000040 <again>:\n  40:\tbl\t40 <again>\n  44:\tbl\t50 <other>\n\n00000050 <other>:\n  50:\tbl\t40 <again>\n\n00000060 <pointer>:\n  60:\tblx\tr3\n\n00000070 <moves>:\n  70:\tadd\tsp, r4\n\
        \n00000080 <restores>:\n  80:\tpush\t{r7, lr}\n  82:\tsub\tsp, #40\n  84:\tsubs\tr6, r7, #7\n  86:\tsubs\tr6, #5\n  88:\tmov\tsp, r6\n  8a:\tbl\t86 <restores+0x6>\n\n\
        00000100 <large>:\n 100:\tldr\tr6, [pc, #8]\t@ (10c <large+0xc>)\n 102:\tadd\tsp, r6\n 104:\tldr\tr6, [pc, #8]\t@ (110 <large+0x10>)\n 106:\tadd\tsp, r6\n 10c:\t.word\t0xfffffd40\n 110:\t.word\t0x000002c0\n\n00000090 <jumps>:\n  90:\tmov\tsp, r6\n";
    const RISCV: &str = "80000000 <step>:\n80000000:\taddi\tsp,sp,-64\n80000004:\tjal\tra,80000010 <decide>\n80000008:\taddi\tsp,sp,64\n8000000a:\tret\n\n80000010 <decide>:\n80000010:\taddi\tsp,sp,-16\n80000012:\tj\t80000010 <decide>\n";

    #[test]
    fn depths_are_summed_along_the_deepest_call() {
        let program = Program::of(ARM);
        assert_eq!(program.deepest("end").unwrap(), 4);
        assert_eq!(program.deepest("decide").unwrap(), 8 + 8 + 4);
        assert_eq!(program.deepest("step").unwrap(), 16 + 16 + 1024 + 20);
        assert_eq!(program.deepest("restores").unwrap(), 48);
        assert_eq!(program.deepest("large").unwrap(), 0x2c0);
        assert_eq!(Program::of(RISCV).deepest("step").unwrap(), 80);
    }

    #[test]
    fn unknown_depths_are_errors() {
        let program = Program::of(ARM);
        for name in ["again", "pointer", "moves", "jumps", "missing"] {
            assert!(program.deepest(name).is_err(), "{name}");
        }
    }
}
