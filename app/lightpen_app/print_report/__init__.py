"""The record of a calibration on paper: its words, its pages, printed and as PDF."""
