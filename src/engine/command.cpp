#include "engine/command.hpp"

namespace fathom::engine {

void CommandList::append(const CommandList& other) {
  const auto first = static_cast<std::uint32_t>(definitions_.size());
  commands_.reserve(commands_.size() + other.commands_.size());
  for (Command command : other.commands_) {
    if (command.kind == CommandKind::add) command.definition += first;
    commands_.push_back(command);
  }
  definitions_.insert(definitions_.end(), other.definitions_.begin(), other.definitions_.end());
}

}  // namespace fathom::engine
