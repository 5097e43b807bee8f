// Executes commands on a world and maps handles to bodies.
#pragma once

#include <fathom/world.hpp>
#include <span>
#include <vector>

#include "engine/command.hpp"

namespace fathom::engine {

class CommandRunner {
 public:
  /// Bodies already in the world use their ids as handles.
  explicit CommandRunner(World& world);

  /// Executes the commands in order. Throws what the world throws, naming the command and its body.
  void run(const CommandList& list);

  const World& world() const { return *world_; }
  /// Whether the handle has a body.
  bool contains(BodyHandle handle) const;
  /// The body of a handle. Throws `Error{stale_id}` if it has none.
  BodyId body(BodyHandle handle) const;
  /// The handle of a living body; generation 0 if it has none.
  BodyHandle handle(BodyId body) const;

  /// By handle index; generation 0 if unused.
  struct Entry {
    std::uint32_t generation = 0;
    BodyId body;
  };
  const std::vector<Entry>& entries() const { return entries_; }
  /// Adopts the entries of another runner after this one's world was restored from that one's. Throws `Error{file}` if
  /// they name bodies that do not exist.
  void set_entries(std::vector<Entry> entries);

 private:
  void run(const Command& command, const CommandList& list);
  void run(CommandKind kind, BodyId a, const JointOrder& order);
  bool add_together(std::span<const Command> additions, const CommandList& list);
  void add(BodyHandle handle, const BodyDef& definition);
  void note(BodyHandle handle, BodyId body);

  World* world_;
  std::vector<Entry> entries_;
  std::vector<BodyHandle> handles_;  // by body index
};

}  // namespace fathom::engine
