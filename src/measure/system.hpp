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
/// The most memory this process has had (bytes).
std::uint64_t peak_memory();
/// How often the system took the processor away from this process's threads for others.
std::uint64_t interruptions();
bool stderr_is_terminal();
/// Says it on stderr. That it cannot be said (stderr is closed, its disk full) ends nothing.
void tell(std::string_view text);
/// Takes the numbers of stdin, stdout and stderr where they are closed, else the first files that are opened get them
/// and, between their own, what is printed. What is printed still goes nowhere.
void keep_standard_descriptors();
/// How many characters a line of the terminal holds that stderr goes to; 80 where it does not tell.
std::size_t terminal_columns();
/// As much of the text (ASCII) as fits into one line of it, so that a line that is written over stays one.
std::string fit_to_terminal(std::string text);
/// A file that reaches the process's size limit is then an error like a full disk, not the program's end.
void survive_file_size_limit();

/// While it lives, the first Ctrl-C (or SIGTERM) asks for an end; another one, half a second later or more, does what
/// it did before, which is to end the program at once.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool requested();
};

}  // namespace fathom
