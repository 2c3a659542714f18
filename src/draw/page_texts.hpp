#pragma once

#include <functional>
#include <map>
#include <string>

namespace clerestory::page_texts {

/// Every .html and .css file of src/, by name.
const std::map<std::string, std::string, std::less<>>& all();

}  // namespace clerestory::page_texts
