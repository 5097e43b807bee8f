// Removes this process's temporary files on a fatal signal.
#pragma once

#include <string>

namespace fathom::files {

/// For programs, once at the start: signals that end the process, except crashes and SIGKILL, first remove the files
/// being written. Handlers set later replace these.
void remove_unfinished_on_signals();

/// Files not yet in place.
void note_unfinished(const std::string& name);
void forget_unfinished(const std::string& name);

}  // namespace fathom::files
