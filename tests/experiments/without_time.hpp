// What a run folder of `clerestory train` holds, but for time: two runs that should agree are compared by it.
#pragma once
#include <filesystem>
#include <map>
#include <string>

namespace clerestory {

/// Each file below `run` by name. Files that hold no time are their bytes; of the others, in short:
///   safetensors   every tensor and all metadata; not the seconds in "training.progress", not hours and dates
///   JSON, JSONL   every key but those of clocks (seconds, started, ended, hours, speed), and a hash over a file with
///   time log.txt       what was said of each step, once: a resumed run says other things about itself card.md every
///   line without hours, dates or that hash report.html   text, tables, pictures, plots against steps; not the plot
///   against hours, nor the facts about speed DONE, *.svg   that they are there: a date; a plot against hours
std::map<std::string, std::string> without_time(const std::filesystem::path& run);

}  // namespace clerestory
