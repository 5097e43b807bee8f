// The sections of the report as HTML.
#pragma once

#include <string>

#include "view.hpp"

namespace fathom::campaign {

/// The results in words.
std::string summary_section(const View& view);
/// Average stage durations beside the published ones, laid out as tables 4.2 to 4.5.
std::string stage_tables_section(const View& view);
/// The number of bodies from which each device beats the native simulator.
std::string crossover_section(const View& view);
/// Quality behind the speed: displacement, penetration, energy, spikes.
std::string quality_section(const View& view);
std::string pictures_section(const View& view, const Store& store);
/// Durations over time, laid out as figures 4.11 to 4.49, and against the number of bodies.
std::string duration_section(const View& view);
/// Figures 4.1 to 4.9: numbers of threads.
std::string threads_section(const View& view);
/// Runs that are missing from the tables, and why.
std::string exclusions_section(const View& view);

}  // namespace fathom::campaign
