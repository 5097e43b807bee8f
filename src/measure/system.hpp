// Information from the operating system about the machine and this process.
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
/// Opens stdin, stdout and stderr on /dev/null if they are closed. Otherwise the first files opened would get their
/// numbers and receive printed text. Printed text is still discarded.
void keep_standard_descriptors();
/// Characters per line of the terminal behind stderr; 80 if unknown.
std::size_t terminal_columns();
/// As much of the text (ASCII) as fits on one such line: a wrapped line could not be overwritten.
std::string fit_to_terminal(std::string text);
/// Makes exceeding the process's file size limit a write error, like a full disk, instead of killing the program.
void survive_file_size_limit();

/// While it exists, the first Ctrl-C (or SIGTERM) requests an end; another one, half a second later or more, has its
/// original effect and ends the program at once.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool requested();
};

}  // namespace fathom
