// The figures of a run, as JSON and as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "run.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// Keys keep the order they are written in.
using Json = nlohmann::ordered_json;

Json to_json(const Scene& scene, const RunResult& result);
/// A table for people, from what `to_json` wrote.
std::string to_text(const Json& report);

}  // namespace fathom::cli
