// What the operating system knows about the machine and this process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace fathom {

/// The processor's model name.
std::string processor_name();
/// The machine's memory (bytes).
std::uint64_t machine_memory();
/// The operating system's name and version.
std::string system_name();
/// Peak memory of this process (bytes).
std::uint64_t peak_memory();
/// How often the system preempted this process's threads in favour of others.
std::uint64_t interruptions();
bool stderr_is_terminal();
/// Prints it on stderr. Failure (stderr closed, disk full) is ignored.
void tell(std::string_view text);
/// Opens stdin, stdout and stderr on /dev/null if they are closed; otherwise the first files opened would get their
/// numbers, and printed text would end up in them. Printed text is still discarded.
void keep_standard_descriptors();
/// Characters per line of the terminal behind stderr; 80 if unknown.
std::size_t terminal_columns();
/// As much of the text (ASCII) as fits into one such line, so that an overwritten line stays one line.
std::string fit_to_terminal(std::string text);
/// Makes reaching the process's file size limit an error like a full disk, instead of ending the program.
void survive_file_size_limit();

/// While it lives, the first Ctrl-C (or SIGTERM) requests an end; another one, half a second later or more, has its
/// original effect, which is to end the program at once.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool requested();
};

}  // namespace fathom
