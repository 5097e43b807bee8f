// Temporary files of this process, so that a fatal signal leaves none behind.
#pragma once

#include <string>

namespace fathom::files {

/// For programs, once at their start: signals that end the process, except crashes and SIGKILL, still do, but first
/// remove the files being written. Handlers set later replace these.
void remove_unfinished_on_signals();

/// Files that are not in place yet.
void note_unfinished(const std::string& name);
void forget_unfinished(const std::string& name);

}  // namespace fathom::files
