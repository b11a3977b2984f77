// What a validation found on each view by itself, which means hide: a study compares trainings room by room.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// The list of the validation rooms; others have the names of data.lists.
inline constexpr const char* kValidationList = "validation";

struct JudgedErrors {
  std::string room, view;
  std::vector<double> errors;  // by error_names() of what is trained, NaN where the view has none
};
/// Of one list of rooms.
struct JudgedErrorsList {
  std::string list;
  std::vector<JudgedErrors> views;
};

/// `view`: "FOLDER/ROOM/VIEW".
JudgedErrors judged_errors(const std::string& view, std::vector<double> errors);

/// As JSON, and back. Throws usage_error naming the file.
void write_judged_errors(const std::filesystem::path& file, const std::vector<JudgedErrorsList>& lists);
std::vector<JudgedErrorsList> read_judged_errors(const std::filesystem::path& file);

}  // namespace clerestory
