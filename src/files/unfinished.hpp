// Temporary files of this process, so that a signal that ends it leaves none behind.
#pragma once

#include <string>

namespace fathom::files {

/// For programs, once at their start: signals that end the process, but for crashes and SIGKILL, still end it, but
/// first remove what it was writing. Handlers that are set later take their place.
void remove_unfinished_on_signals();

/// Files that are not in their place yet.
void note_unfinished(const std::string& name);
void forget_unfinished(const std::string& name);

}  // namespace fathom::files
