"""Stylistic similarity (Chien, Liu 2006): segments, features, models and motion adaptation."""
