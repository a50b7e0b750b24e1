"""What moves a vehicle, and what it does when nobody moves it any more."""
