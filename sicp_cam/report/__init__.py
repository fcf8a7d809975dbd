"""Reports: statistics, figures, scenes and the PDF."""
