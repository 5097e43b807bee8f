// Pictures of the environments at start, middle and end, drawn between the steps of measured runs.
#pragma once

#include <memory>
#include <vector>

#include "store.hpp"

namespace fathom::campaign {

/// Draws one run of each environment for every set of algorithms: Fathom's on the native simulator, the dissertation's
/// on the first GPU, or on the host's device if there is none. Draws nothing if this build or machine cannot.
class Painter {
 public:
  /// `device`: where the dissertation's algorithms are shown; `steps` of a whole run.
  Painter(const Store& store, std::string device, std::uint64_t steps);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Call before the first step and after each step.
  void visit(const Case& what, std::uint64_t step, const World& world);
  /// The pictures of the last run.
  std::vector<Picture> take();

 private:
  struct Drawing;

  bool wanted(const Case& what) const;

  const Store& store_;
  std::string device_;
  std::uint64_t steps_;
  std::vector<Picture> pictures_;
  std::unique_ptr<Drawing> drawing_;
};

}  // namespace fathom::campaign
