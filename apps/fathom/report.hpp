// The figures of a run, as JSON and as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "run.hpp"
#include "scene/scene.hpp"

namespace fathom::cli {

/// Keeps keys in the order they are written.
using Json = nlohmann::ordered_json;

Json to_json(const Scene& scene, const RunResult& result);
/// A readable table from the output of `to_json`.
/// `size_note` follows the number of bodies.
std::string to_text(const Json& report, const std::string& size_note);

}  // namespace fathom::cli
